//! The weights of the recursion against their enumeration, on abstract paths (`docs/theory.md`, section 4.9).

mod abstract_paths;
mod golden;
mod recursion;

use abstract_paths::{TECHNIQUES, in_lanes, lane_probabilities, masked, modes, path, plan};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use recursion::{Recursion, is_ok};
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, Strategy as Way, VertexKind};
use upbp_estimators::mis::{ByTechnique, Densities, Heuristic, MisPlan, VolumeMerges};
use upbp_media::Lanes;

/// Every strategy that the kinds of the vertices allow, and the bit of its technique.
fn strategies<L: Lanes>(path: &Path<L>) -> Vec<(Way, u32)> {
    let k = path.length();
    let ok = |i: usize| is_ok(&path.vertices[i]);
    let mut ways = vec![(Way::Hit, 0)];
    if k == 1 || ok(1) {
        ways.push((Way::Nee, 1));
    }
    ways.extend((2..k).filter(|&s| ok(s - 1) && ok(s)).map(|s| (Way::Connect(s), 2)));
    if k >= 2 && ok(k - 1) {
        ways.push((Way::LightTracing, 3));
    }
    for i in 1..k {
        match path.vertices[i].kind {
            VertexKind::Surface => ways.push((Way::Surf(i), 4)),
            VertexKind::Medium(_) => {
                ways.extend([(Way::Pp3d(i), 5), (Way::Pb2d(i), 6), (Way::Bp2d(i), 7), (Way::Bb1d(i), 8)]);
            }
            VertexKind::End | VertexKind::Volume | VertexKind::Delta => {}
        }
    }
    ways
}

/// The extremes that a comparison has reached.
#[derive(Default)]
struct Reached {
    weights: u64,
    difference: f64,
    sum: f64,
}

impl Reached {
    /// Compares all weights of one path under one plan.
    ///
    /// A weight is known to the rounding of the sum that it is a part of: differences count relative to the
    /// weight down to `1e-200`, below which squares of densities leave the range of normal numbers.
    fn compare<D: Densities, L: Lanes>(
        &mut self,
        plan: &MisPlan,
        path: &Path<L>,
        mask: u32,
    ) -> Result<(), TestCaseError> {
        let expected = path.weights(plan);
        let recursion = Recursion::<D, L>::new(plan, path);
        let mut sum = 0.0;
        for &(way, weight) in &expected {
            let found = recursion.weight(way).value();
            sum += found;
            if weight < 1e-200 {
                prop_assert!(found < 1e-190, "{way:?}: {found} for {weight}");
                continue;
            }
            let difference = (found / weight - 1.0).abs();
            prop_assert!(difference <= 1e-10, "{way:?}: {found}, expected {weight}, mask {mask:09b}");
            self.weights += 1;
            self.difference = self.difference.max(difference);
        }
        if !expected.is_empty() {
            prop_assert!((sum - 1.0).abs() <= 1e-10, "sum {sum}, mask {mask:09b}");
            self.sum = self.sum.max((sum - 1.0).abs());
        }
        for (way, bit) in strategies(path) {
            if mask >> bit & 1 == 0 {
                prop_assert!(expected.iter().all(|(other, _)| *other != way), "{way:?} is off");
                prop_assert_eq!(path.weight(plan, way), 0.0);
                // The recursion is only asked by techniques that run; zero counts must give zero all the
                // same, unless nothing makes the path or this sub-path does not exist.
                let found = recursion.weight(way).value();
                prop_assert!(
                    found == 0.0 || !found.is_finite() || way == Way::Hit,
                    "{way:?} is off: {found}"
                );
            }
        }
        Ok(())
    }

    /// Compares the parts that techniques have in all weights of one path.
    fn compare_by_technique<L: Lanes>(
        &mut self,
        plan: &MisPlan,
        path: &Path<L>,
    ) -> Result<(), TestCaseError> {
        let expected = path.weights(plan);
        let recursion = Recursion::<ByTechnique, L>::new(plan, path);
        let bits = strategies(path);
        let mut parts = [0.0; TECHNIQUES as usize];
        for (way, weight) in &expected {
            let (_, bit) = bits.iter().find(|(other, _)| other == way).expect("a strategy");
            parts[*bit as usize] += weight;
        }
        for &(way, weight) in expected.iter().filter(|(_, weight)| *weight > 1e-200) {
            let found = recursion.weight(way);
            let difference = (found.value() / weight - 1.0).abs();
            prop_assert!(difference <= 1e-10, "{way:?}: {found:?}, expected {weight}");
            for (bit, (density, part)) in found.all.of.iter().zip(parts).enumerate() {
                let found = density / found.all.total();
                prop_assert!(
                    (found - part).abs() <= 1e-10 * part + 1e-200,
                    "{way:?}, {bit}: {found}, {part}"
                );
            }
            self.weights += 1;
            self.difference = self.difference.max(difference);
        }
        Ok(())
    }

    fn report(&self, name: &str) {
        println!(
            "{name}: {} weights, largest relative difference {:.2e}, largest |sum - 1| {:.2e}",
            self.weights, self.difference, self.sum
        );
    }
}

/// Longest path and spread of the densities. The power heuristic squares densities: a chain of ratios of
/// `e^{±16}` must be short to stay within double precision.
const RANGES: [(usize, f64); 5] = [(20, 3.0), (20, 5.0), (9, 8.0), (6, 12.0), (4, 16.0)];

/// Compares by 1000 paths of each range and heuristic, with all modes.
fn for_all_ranges(name: &str, mut compare: impl FnMut(&mut Reached, &MisPlan, &Path)) {
    for (longest, spread) in RANGES {
        let mut runner = TestRunner::deterministic();
        let strategy = (path(longest, spread), plan());
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            let mut reached = Reached::default();
            for case in 0..1000 {
                let (path, plan) = strategy.new_tree(&mut runner).unwrap().current();
                let (_, photon_beams, query_beams) = modes().nth(case % 4).unwrap();
                compare(&mut reached, &MisPlan { heuristic, photon_beams, query_beams, ..plan }, &path);
            }
            reached.report(&format!("{name}, k <= {longest}, e^±{spread}, {heuristic:?}"));
        }
    }
}

/// Masks in an order such that every one comes with every mode and many paths: an odd step through a power of
/// two.
fn masks() -> impl Iterator<Item = u32> {
    (0..).map(|step: u32| step.wrapping_mul(189) % (1 << TECHNIQUES))
}

#[test]
fn recursion_equals_the_enumeration_for_all_masks() {
    let mut masks = masks();
    for_all_ranges("sums", |reached, plan, path| {
        for mask in masks.by_ref().take(16).chain([(1 << TECHNIQUES) - 1]) {
            reached.compare::<f64, _>(&masked(plan, mask), path, mask).unwrap();
        }
    });
}

#[test]
fn the_recursion_by_technique_tells_the_part_of_each() {
    let mut masks = masks();
    for_all_ranges("by technique", |reached, plan, path| {
        for mask in masks.by_ref().take(2).chain([(1 << TECHNIQUES) - 1]) {
            reached.compare_by_technique(&masked(plan, mask), path).unwrap();
        }
    });
}

/// Compares by 700 paths in lanes of each range.
fn for_all_ranges_in_lanes(name: &str, mut compare: impl FnMut(&mut Reached, &MisPlan, &Path<[f64; 3]>)) {
    for (longest, spread) in [(1, 3.0), (3, 3.0), (9, 2.0), (20, 3.0), (9, 8.0), (4, 12.0)] {
        let mut runner = TestRunner::deterministic();
        let paths = path(longest, spread).prop_flat_map(move |path| in_lanes(path, spread));
        let strategy = (paths, plan(), lane_probabilities());
        let mut reached = Reached::default();
        for case in 0..700 {
            let (path, plan, lanes) = strategy.new_tree(&mut runner).unwrap().current();
            let (_, photon_beams, query_beams) = modes().nth(case % 4).unwrap();
            compare(&mut reached, &MisPlan { photon_beams, query_beams, lanes, ..plan }, &path);
        }
        reached.report(&format!("{name}, k <= {longest}, e^±{spread}"));
    }
}

#[test]
fn recursion_in_lanes_equals_the_enumeration_over_all_heroes() {
    let mut masks = masks();
    for_all_ranges_in_lanes("lanes", |reached, plan, path| {
        for mask in masks.by_ref().take(8).chain([(1 << TECHNIQUES) - 1]) {
            reached.compare::<f64, _>(&masked(plan, mask), path, mask).unwrap();
        }
    });
}

#[test]
fn the_recursion_in_lanes_by_technique_tells_the_part_of_each() {
    let mut masks = masks();
    for_all_ranges_in_lanes("lanes by technique", |reached, plan, path| {
        for mask in masks.by_ref().take(1).chain([(1 << TECHNIQUES) - 1]) {
            reached.compare_by_technique(&masked(plan, mask), path).unwrap();
        }
    });
}

#[test]
fn equal_lanes_are_one_lane() {
    let mut runner = TestRunner::deterministic();
    let strategy = (path(9, 4.0), plan(), lane_probabilities());
    for case in 0..500 {
        let (path, plan, lanes) = strategy.new_tree(&mut runner).unwrap().current();
        let (_, photon_beams, query_beams) = modes().nth(case % 4).unwrap();
        let plan = MisPlan { photon_beams, query_beams, lanes, ..plan };
        let edges = path.edges.iter().map(|edge| PathEdge {
            distance: edge.distance,
            t_light: [edge.t_light; 3],
            t_camera: [edge.t_camera; 3],
            pass_probability: [edge.pass_probability; 3],
        });
        let Path { ref vertices, pdf_position, pdf_incident, hittable, .. } = path;
        let vertices =
            vertices.iter().map(|vertex| vertex.with_lanes(|rho| [rho; 3], |rho| [rho; 3])).collect();
        let three = Path { edges: edges.collect(), vertices, pdf_position, pdf_incident, hittable };
        for (way, weight) in path.weights(&plan) {
            let found = Recursion::<f64, [f64; 3]>::new(&plan, &three).weight(way).value();
            assert!((found - weight).abs() <= 1e-10 * weight + 1e-200, "{way:?}: {found}, {weight}");
            assert!((three.weight(&plan, way) - weight).abs() <= 1e-10 * weight + 1e-200, "{way:?}");
        }
    }
}

#[test]
fn the_balance_heuristic_stands_long_paths_of_wild_densities() {
    let mut runner = TestRunner::deterministic();
    let strategy = (path(12, 16.0), plan());
    let mut reached = Reached::default();
    for case in 0..4000_u32 {
        let (path, plan) = strategy.new_tree(&mut runner).unwrap().current();
        let (heuristic, photon_beams, query_beams) = modes().nth(case as usize % 4).unwrap();
        let plan = MisPlan { heuristic, photon_beams, query_beams, ..plan };
        let mask = case * 189 % (1 << TECHNIQUES);
        reached.compare::<f64, _>(&masked(&plan, mask), &path, mask).unwrap();
    }
    reached.report("k <= 12, e^±16, balance");
}

/// The path walked from the other end.
fn reversed(path: &Path) -> Path {
    let vertices = path.vertices.iter().rev().map(|v| PathVertex {
        kind: v.kind,
        rho_light: v.rho_camera,
        rho_camera: v.rho_light,
        cos_light: v.cos_camera,
        cos_camera: v.cos_light,
        sin_theta: v.sin_theta,
        scale: v.scale,
    });
    let edges = path.edges.iter().rev().map(|e| PathEdge {
        distance: e.distance,
        t_light: e.t_camera,
        t_camera: e.t_light,
        pass_probability: e.pass_probability,
    });
    Path { vertices: vertices.collect(), edges: edges.collect(), ..path.clone() }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn recursion_equals_the_enumeration(
        path in path(9, 6.0),
        plan in plan(),
        mask in 0_u32..1 << TECHNIQUES,
    ) {
        for (heuristic, photon_beams, query_beams) in modes() {
            let plan = masked(&MisPlan { heuristic, photon_beams, query_beams, ..plan.clone() }, mask);
            Reached::default().compare::<f64, _>(&plan, &path, mask)?;
        }
    }

    #[test]
    fn another_technique_takes_and_never_gives(
        path in path(9, 4.0),
        plan in plan(),
        mask in 0_u32..1 << TECHNIQUES,
        added in 0..TECHNIQUES,
    ) {
        for (heuristic, photon_beams, query_beams) in modes() {
            let plan = MisPlan { heuristic, photon_beams, query_beams, ..plan.clone() };
            let fewer = masked(&plan, mask & !(1 << added));
            let more = masked(&plan, mask | 1 << added);
            let recursion = Recursion::<f64>::new(&more, &path);
            for (way, before) in path.weights(&fewer) {
                let after = path.weight(&more, way);
                prop_assert!(after <= before * (1.0 + 1e-12), "{way:?}: {before} to {after}");
                prop_assert!(recursion.weight(way).value() <= before * (1.0 + 1e-10) + 1e-200, "{way:?}");
            }
        }
    }

    #[test]
    fn the_two_ends_change_roles(path in path(9, 4.0), plan in plan(), mask in 0_u32..1 << TECHNIQUES) {
        // Between two points: no end can be hit, next events and light tracing are mirror images.
        // With one edge only next events at the lens remain, and light tracing does not make the like.
        let pdf_incident = if path.length() == 1 { 0.0 } else { 1.0 };
        let mut path = Path { pdf_position: 1.0, pdf_incident, hittable: false, ..path };
        path.vertices[0].cos_camera = 1.0;
        path.edges[0].distance = path.edges[0].distance.min(1e3);
        let k = path.length();
        for (heuristic, photon_beams, query_beams) in modes() {
            let plan = masked(&MisPlan { heuristic, photon_beams, query_beams, ..plan.clone() }, mask);
            let swap = |v: &VolumeMerges<_>| VolumeMerges { pb2d: v.bp2d, bp2d: v.pb2d, ..*v };
            let mirrored = MisPlan {
                nee: plan.light_tracing,
                light_tracing: plan.nee,
                volume: plan.volume.iter().map(swap).collect(),
                photon_beams: query_beams,
                query_beams: photon_beams,
                ..plan.clone()
            };
            let weights = path.weights(&plan);
            let there = reversed(&path);
            prop_assert_eq!(weights.len(), there.weights(&mirrored).len());
            let recursion = Recursion::<f64>::new(&mirrored, &there);
            for (way, weight) in weights {
                let image = match way {
                    Way::Hit => Way::Hit,
                    Way::Nee => Way::LightTracing,
                    Way::LightTracing => Way::Nee,
                    Way::Connect(s) => Way::Connect(k + 1 - s),
                    Way::Surf(i) => Way::Surf(k - i),
                    Way::Pp3d(i) => Way::Pp3d(k - i),
                    Way::Pb2d(i) => Way::Bp2d(k - i),
                    Way::Bp2d(i) => Way::Pb2d(k - i),
                    Way::Bb1d(i) => Way::Bb1d(k - i),
                };
                let mirror = there.weight(&mirrored, image);
                prop_assert!((mirror - weight).abs() <= 1e-11 * weight, "{way:?}: {weight}, {mirror}");
                let mirror = recursion.weight(image).value();
                prop_assert!((mirror - weight).abs() <= 1e-10 * weight + 1e-200, "{way:?}: {weight}, {mirror}");
            }
        }
    }
}
