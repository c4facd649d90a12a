//! The weights of the recursion against their enumeration, on abstract paths (`docs/theory.md`, sections 4.9
//! and 11).

mod support;

use std::f64::consts::PI;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use support::{TECHNIQUES, masked, modes, path, plan};
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, Strategy as Way, VertexKind};
use upbp_estimators::mis::{
    BeamExtent, ByTechnique, Densities, Edge, End, Heuristic, MergeSite, MisPlan, Pending, Tip, VolumeMerges,
    Weight,
};
use upbp_estimators::scene::Walk;
use upbp_estimators::{MediumId, Technique};

/// Weights by the recursion, with exactly the calls that the walks make.
struct Recursion<'a, D> {
    plan: &'a MisPlan,
    path: &'a Path,
    /// By vertex; those that a walk does not arrive at stay empty.
    light: Vec<Tip<D>>,
    camera: Vec<Tip<D>>,
    /// On arrival of the camera walk at the light, with next events as connections.
    at_light: Tip<D>,
}

fn is_ok(vertex: &PathVertex) -> bool {
    matches!(vertex.kind, VertexKind::Surface | VertexKind::Medium(_))
}

fn in_medium(vertex: &PathVertex) -> bool {
    matches!(vertex.kind, VertexKind::Medium(_))
}

fn site(vertex: &PathVertex) -> MergeSite {
    match vertex.kind {
        VertexKind::Surface => MergeSite::Surface,
        VertexKind::Medium(medium) => MergeSite::Medium { medium, sin_theta: vertex.sin_theta },
        VertexKind::End | VertexKind::Delta => MergeSite::None,
    }
}

fn distance_squared(edge: &PathEdge) -> f64 {
    if edge.distance.is_finite() { edge.distance * edge.distance } else { 1.0 }
}

/// What a vertex passes on after it has scattered.
fn pend<D: Densities>(
    plan: &MisPlan,
    vertex: &PathVertex,
    tip: &Tip<D>,
    rho: f64,
    rho_opposite: f64,
    cos_out: f64,
) -> Pending<D> {
    let tip = if is_ok(vertex) { *tip } else { Tip { connect: D::ZERO, ..*tip } };
    Pending {
        before: tip.before(plan, rho_opposite),
        rho,
        cos_out,
        site: site(vertex),
        c: tip.c,
        connectible: is_ok(vertex),
        in_medium: in_medium(vertex),
    }
}

impl<'a, D: Densities> Recursion<'a, D> {
    fn new(plan: &'a MisPlan, path: &'a Path) -> Self {
        let (k, v) = (path.length(), &path.vertices);
        let nowhere = Tip { connect: D::ZERO, below: D::ZERO, c: 0.0 };
        let mut light = vec![nowhere; k + 1];
        let mut pending =
            Pending::at_light(plan, path.hittable, v[0].cos_camera, path.pdf_position, v[0].rho_light);
        for i in 1..k {
            let e = &path.edges[i - 1];
            let edge = Edge {
                distance_squared: distance_squared(e),
                cos_in: v[i].cos_light,
                forward: e.t_light,
                backward: e.t_camera,
                reach: e.reach,
                ends_in_medium: in_medium(&v[i]),
            };
            let connections = if !is_ok(&v[i]) {
                D::ZERO
            } else if i == 1 {
                D::of(Technique::Nee, plan.pow(plan.nee * path.pdf_incident / path.pdf_position))
            } else {
                plan.connections()
            };
            light[i] = pending.arrive(plan, Walk::Light, &edge, connections);
            pending = pend(plan, &v[i], &light[i], v[i].rho_light, v[i].rho_camera, v[i].cos_camera);
        }
        let mut camera = vec![nowhere; k + 1];
        let mut at_light = nowhere;
        let mut pending = Pending::at_camera(v[k].rho_camera);
        for i in (0..k).rev() {
            let e = &path.edges[i];
            let edge = Edge {
                distance_squared: distance_squared(e),
                cos_in: v[i].cos_camera,
                forward: e.t_camera,
                backward: e.t_light,
                reach: e.reach,
                ends_in_medium: in_medium(&v[i]),
            };
            if i == 0 {
                let next_events = D::of(Technique::Nee, plan.pow(plan.nee));
                at_light = pending.arrive(plan, Walk::Camera, &edge, next_events);
                break;
            }
            let connections = if !is_ok(&v[i]) {
                D::ZERO
            } else if i + 1 == k {
                D::of(Technique::LightTracing, plan.pow(plan.light_tracing))
            } else {
                plan.connections()
            };
            camera[i] = pending.arrive(plan, Walk::Camera, &edge, connections);
            pending = pend(plan, &v[i], &camera[i], v[i].rho_camera, v[i].rho_light, v[i].cos_light);
        }
        Self { plan, path, light, camera, at_light }
    }

    /// The end of the light sub-path at vertex `i`, with the edge that the camera's side would arrive by.
    fn light_end(&self, i: usize) -> End<D> {
        let (vertex, edge) = (&self.path.vertices[i], &self.path.edges[i]);
        let c = match vertex.kind {
            VertexKind::Medium(_) => self.plan.distance_factor(Walk::Camera, edge.reach, edge.t_camera),
            _ => 0.0,
        };
        End {
            merges: self.plan.merge_sum(site(vertex), Walk::Light, self.light[i].c, c),
            before: self.light[i].before(self.plan, vertex.rho_camera),
        }
    }

    /// The end of the camera sub-path at vertex `i`, with the edge that the light's side would arrive by.
    fn camera_end(&self, i: usize) -> End<D> {
        let (vertex, edge) = (&self.path.vertices[i], &self.path.edges[i - 1]);
        let c = match vertex.kind {
            VertexKind::Medium(_) => self.plan.distance_factor(Walk::Light, edge.reach, edge.t_light),
            _ => 0.0,
        };
        End {
            merges: self.plan.merge_sum(site(vertex), Walk::Camera, self.camera[i].c, c),
            before: self.camera[i].before(self.plan, vertex.rho_light),
        }
    }

    /// `L_i`, given that vertex `i − 1` scatters towards it.
    fn light_density(&self, i: usize) -> f64 {
        let (edge, v) = (&self.path.edges[i - 1], &self.path.vertices);
        v[i - 1].rho_light * v[i].cos_light / distance_squared(edge) * edge.t_light
    }

    /// `C_i`, given that vertex `i + 1` scatters towards it.
    fn camera_density(&self, i: usize) -> f64 {
        let (edge, v) = (&self.path.edges[i], &self.path.vertices);
        v[i + 1].rho_camera * v[i].cos_camera / distance_squared(edge) * edge.t_camera
    }

    fn merge(&self, i: usize, factor: impl Fn(&VolumeMerges) -> f64) -> Weight<D> {
        let vertex = &self.path.vertices[i];
        let (light, camera) = (&self.light[i], &self.camera[i]);
        let (factor, merges) = if let VertexKind::Medium(medium) = vertex.kind {
            let factors = self.plan.volume_factors(medium, light.c, camera.c, vertex.sin_theta);
            (factor(&factors), factors.sum())
        } else {
            let factor = self.plan.pow(self.plan.surf);
            (factor, D::of(Technique::Surf, factor))
        };
        let before_light = light.before(self.plan, vertex.rho_camera);
        let before_camera = camera.before(self.plan, vertex.rho_light);
        self.plan.merge_weight(factor, merges, before_light, before_camera)
    }

    fn weight(&self, way: Way) -> Weight<D> {
        let Self { plan, path, .. } = *self;
        let k = path.length();
        let rho_light = path.vertices[0].rho_light;
        match way {
            Way::Hit if k == 1 => Weight::alone(Technique::Hit),
            Way::Hit => plan.hit_weight(&self.at_light, path.pdf_incident, path.pdf_position, rho_light),
            Way::Nee => plan.nee_weight(
                path.pdf_incident,
                path.pdf_position,
                if path.hittable { self.camera_density(0) } else { 0.0 },
                self.camera_end(1),
                self.light_density(1),
            ),
            Way::Connect(s) => plan.connect_weight(
                self.light_end(s - 1),
                self.camera_density(s - 1),
                self.camera_end(s),
                self.light_density(s),
            ),
            Way::LightTracing => plan.light_tracing_weight(self.light_end(k - 1), self.camera_density(k - 1)),
            Way::Surf(i) => self.merge(i, |_| 0.0),
            Way::Pp3d(i) => self.merge(i, |v| v.pp3d),
            Way::Pb2d(i) => self.merge(i, |v| v.pb2d),
            Way::Bp2d(i) => self.merge(i, |v| v.bp2d),
            Way::Bb1d(i) => self.merge(i, |v| v.bb1d),
        }
    }
}

/// Every strategy that the kinds of the vertices allow, and the bit of its technique.
fn strategies(path: &Path) -> Vec<(Way, u32)> {
    let k = path.length();
    let ok = |i: usize| is_ok(&path.vertices[i]);
    let mut ways = vec![(Way::Hit, 0)];
    if k >= 2 && ok(1) {
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
            VertexKind::End | VertexKind::Delta => {}
        }
    }
    ways
}

/// What a comparison has reached.
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
    fn compare(&mut self, plan: &MisPlan, path: &Path, mask: u32) -> Result<(), TestCaseError> {
        let expected = path.weights(plan);
        let recursion = Recursion::<f64>::new(plan, path);
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
    fn compare_by_technique(&mut self, plan: &MisPlan, path: &Path) -> Result<(), TestCaseError> {
        let expected = path.weights(plan);
        let recursion = Recursion::<ByTechnique>::new(plan, path);
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
            for (bit, (density, part)) in found.all.0.iter().zip(parts).enumerate() {
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

#[test]
fn recursion_equals_the_enumeration_for_all_masks() {
    for (longest, spread) in RANGES {
        let mut runner = TestRunner::deterministic();
        let strategy = (path(longest, spread), plan());
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            let mut reached = Reached::default();
            let mut mask = 0_u32;
            for case in 0..3000_u32 {
                let (path, plan) = strategy.new_tree(&mut runner).unwrap().current();
                let (_, photon_beams, query_beams) = modes().nth(case as usize % 4).unwrap();
                let plan = MisPlan { heuristic, photon_beams, query_beams, ..plan };
                // An odd step through a power of two: every mask comes with every mode and many paths.
                for _ in 0..16 {
                    reached.compare(&masked(&plan, mask), &path, mask).unwrap();
                    mask = (mask + 189) % (1 << TECHNIQUES);
                }
                reached.compare(&plan, &path, (1 << TECHNIQUES) - 1).unwrap();
            }
            reached.report(&format!("k <= {longest}, e^±{spread}, {heuristic:?}"));
        }
    }
}

#[test]
fn the_recursion_by_technique_tells_the_part_of_each() {
    for (longest, spread) in RANGES {
        let mut runner = TestRunner::deterministic();
        let strategy = (path(longest, spread), plan());
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            let mut reached = Reached::default();
            for case in 0..3000_u32 {
                let (path, plan) = strategy.new_tree(&mut runner).unwrap().current();
                let (_, photon_beams, query_beams) = modes().nth(case as usize % 4).unwrap();
                let plan = MisPlan { heuristic, photon_beams, query_beams, ..plan };
                reached.compare_by_technique(&plan, &path).unwrap();
                let mask = case * 189 % (1 << TECHNIQUES);
                reached.compare_by_technique(&masked(&plan, mask), &path).unwrap();
            }
            reached.report(&format!("by technique, k <= {longest}, e^±{spread}, {heuristic:?}"));
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
        reached.compare(&masked(&plan, mask), &path, mask).unwrap();
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
    });
    let edges = path.edges.iter().rev().map(|e| PathEdge {
        distance: e.distance,
        t_light: e.t_camera,
        t_camera: e.t_light,
        reach: e.reach,
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
            Reached::default().compare(&plan, &path, mask)?;
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
        let mut path = Path { pdf_position: 1.0, pdf_incident: 1.0, hittable: false, ..path };
        path.vertices[0].cos_camera = 1.0;
        path.edges[0].distance = path.edges[0].distance.min(1e3);
        let k = path.length();
        for (heuristic, photon_beams, query_beams) in modes() {
            let plan = masked(&MisPlan { heuristic, photon_beams, query_beams, ..plan.clone() }, mask);
            let swap = |v: &VolumeMerges| VolumeMerges { pb2d: v.bp2d, bp2d: v.pb2d, ..*v };
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

/// The path of section 11.
fn golden_path() -> Path {
    let end = PathVertex {
        kind: VertexKind::End,
        rho_light: 0.0,
        rho_camera: 0.0,
        cos_light: 1.0,
        cos_camera: 1.0,
        sin_theta: 0.0,
    };
    let edge = |distance, t_light, t_camera, reach| PathEdge { distance, t_light, t_camera, reach };
    let (first, second) = ((-0.6_f64).exp(), (-0.75_f64).exp());
    Path {
        vertices: vec![
            PathVertex { rho_light: 0.3, cos_camera: 0.7, ..end },
            PathVertex {
                kind: VertexKind::Medium(MediumId(0)),
                rho_light: 0.12,
                rho_camera: 0.09,
                sin_theta: 0.75,
                ..end
            },
            PathVertex {
                kind: VertexKind::Delta,
                rho_light: 0.95,
                rho_camera: 1.023,
                cos_light: 0.9,
                cos_camera: 0.8,
                ..end
            },
            PathVertex {
                kind: VertexKind::Surface,
                rho_light: 0.21,
                rho_camera: 0.17,
                cos_light: 0.6,
                cos_camera: 0.5,
                ..end
            },
            PathVertex { rho_camera: 900.0, ..end },
        ],
        edges: vec![
            edge(2.0, 0.5 * first, first, first),
            edge(1.5, second, 0.5 * second, second),
            edge(0.8, 1.0, 1.0, 1.0),
            edge(3.0, 1.0, 1.0, 1.0),
        ],
        pdf_position: 0.5,
        pdf_incident: 0.4,
        hittable: true,
    }
}

fn golden_plan(query_beams: BeamExtent) -> MisPlan {
    MisPlan {
        heuristic: Heuristic::Balance,
        hit: 1.0,
        nee: 1.0,
        connect: 1.0,
        light_tracing: 1e4,
        surf: 1e4 * PI * 1e-4,
        volume: vec![VolumeMerges {
            pp3d: 1e4 * 4.0 / 3.0 * PI * 8e-6,
            pb2d: 1e4 * 0.75 * PI * 1e-4,
            bp2d: 0.0,
            bb1d: 200.0 * 0.05 / 3.0,
        }],
        photon_beams: BeamExtent::Short,
        query_beams,
    }
}

/// Agreement to the last printed digit.
fn assert_close(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 1e-10, "{what}: {found}, expected {expected}");
}

#[test]
fn the_golden_vector() {
    let path = golden_path();
    let ways =
        [Way::Hit, Way::Nee, Way::LightTracing, Way::Pp3d(1), Way::Pb2d(1), Way::Bb1d(1), Way::Surf(3)];
    let columns = [
        (
            BeamExtent::Long,
            [
                3.347_129_370_500e-3,
                1.548_918_692_909e-1,
                7.052_405_460_405e-1,
                1.335_278_354_410e-3,
                3.975_165_419_721e-2,
                8.435_563_015_422e-2,
                1.107_789_259_227e-2,
            ],
        ),
        (
            BeamExtent::Short,
            [
                3.581_668_308_926e-3,
                1.657_454_009_513e-1,
                7.546_579_275_319e-1,
                1.428_843_536_116e-3,
                2.009_311_222_664e-2,
                4.263_890_843_959e-2,
                1.185_413_900_554e-2,
            ],
        ),
    ];
    for (query_beams, weights) in columns {
        let plan = golden_plan(query_beams);
        let recursion = Recursion::<f64>::new(&plan, &path);
        assert_eq!(path.weights(&plan).len(), ways.len());
        for (way, weight) in ways.into_iter().zip(weights) {
            assert_close(path.weight(&plan, way), weight, &format!("{way:?} enumerated"));
            assert_close(recursion.weight(way).value(), weight, &format!("{way:?} by recursion"));
        }
    }
}

#[test]
fn the_golden_densities_and_partial_sums() {
    let path = golden_path();
    let plan = golden_plan(BeamExtent::Long);
    let recursion = Recursion::<f64>::new(&plan, &path);
    for (i, density) in [(1, 0.020_580_436_353_5), (2, 0.022_673_594_531_6), (3, 0.890_625)] {
        assert_close(recursion.light_density(i), density, &format!("L_{i}"));
    }
    for (i, density) in [(0, 0.008_643_783_268_48), (1, 0.107_384_662_990), (2, 0.2125), (3, 50.0)] {
        assert_close(recursion.camera_density(i), density, &format!("C_{i}"));
    }
    assert_close(recursion.light[1].connect, 38.871_867_741_7, "light D_1");
    assert_close(recursion.light[1].below, 9.333_333_333_33, "light E_1");
    assert_close(recursion.light[2].below, 329.597_679_046, "light E_2");
    assert_close(recursion.light[3].below, 473.232_878_125, "light E_3");
    assert_close(recursion.camera[3].connect, 200.0, "camera D_3");
    assert_close(recursion.camera[2].below, 896.212_908_766, "camera E_2");
    assert_close(recursion.camera[1].below, 1_498.068_498_52, "camera E_1");
    assert_close(recursion.at_light.connect, 115.690_082_564, "camera D_0");
    assert_close(recursion.at_light.below, 1_676.582_942_50, "camera E_0");
    let zero = [
        recursion.light[2].connect,
        recursion.light[3].connect,
        recursion.camera[3].below,
        recursion.camera[2].connect,
        recursion.camera[1].connect,
    ];
    assert_eq!(zero, [0.0; 5], "no connection touches the Dirac vertex, no lens is hit");
}
