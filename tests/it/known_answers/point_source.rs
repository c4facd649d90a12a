//! A point source in an infinite medium: the photons that light sub-paths store.
//!
//! A photon carries flux over density on arrival, so that photons in a volume sum to the fluence integrated
//! over it.

use upbp_core::TechniqueSet;
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::observer::NoObserver;
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::trace::trace_light_path;
use upbp_estimators::{
    IterationChoices, IterationPlan, Kernel, Kernels, MergePeriods, NO_LIMIT, PathLengths, PreparedScene,
    RadiusField, Roulette, StreamKind,
};

use upbp_testing::Estimate;
use upbp_testing::analytic::{Case, Table, cases, medium, narrow_camera, scene};

/// Distances and fluxes of the photons of each light sub-path of a source.
fn photons(case: &Case, paths: u32, each: impl FnMut(&[(f64, f64)])) {
    let sigma_t = case.input("sigma_t");
    let albedo = case.input("albedo");
    let medium = medium((1.0 - albedo) * sigma_t, albedo * sigma_t, case.optional("g").unwrap_or(0.0));
    photons_in(&medium, case.input("power"), Roulette::Below(1.0), 1_000_000, paths, each);
}

/// Distances and fluxes of the photons of each light sub-path of a source of some power in a medium.
fn photons_in(
    medium: &str,
    power: f64,
    roulette: Roulette,
    longest: u32,
    paths: u32,
    mut each: impl FnMut(&[(f64, f64)]),
) {
    let intensity = 0.25 * std::f64::consts::FRAC_1_PI * power;
    let scene = scene(&format!(
        "{} outside: \"m\", media: {{\"m\": {medium}}}, lights: [Point(position: (0.0, 0.0, 0.0), intensity: {intensity:?})],",
        narrow_camera([10.0, 0.0, 0.0], [0.0; 3], 1),
    ));
    let world = PreparedScene::new(&scene).expect("a valid scene");
    let plan = IterationPlan::new(
        &scene,
        &IterationChoices {
            seed: 1,
            iteration: 0,
            techniques: "pp3d".parse::<TechniqueSet>().expect("a technique"),
            light_paths: paths,
            beam_paths: 1,
            connections: 1.0,
            next_events: 1.0,
            camera_factor: 1.0,
            periods: MergePeriods::ONE,
            vertices_per_light_path: 1.0,
            lengths: PathLengths { min: 1, max: longest },
            roulette,
            kernels: Kernels { pp3d: Kernel::ball(0.1), ..Kernels::NONE },
            radius_field: RadiusField::Uniform,
            mean_free_paths: NO_LIMIT,
            heuristic: Heuristic::Balance,
            photon_beams: BeamExtent::Short,
            query_beams: BeamExtent::Long,
            lanes: None,
            features: false,
        },
    );
    let context = Context { prepared: &world, plan: &plan };
    let (mut scratch, mut chunk, mut list) =
        (Scratch::default(), LightChunk::<_, f64, f64>::default(), Vec::new());
    for path in 0..paths {
        trace_light_path(&context, StreamKind::Light, path, &mut scratch, &mut chunk, &mut NoObserver);
        list.extend(
            chunk.vertices.drain(..).map(|v| (f64::from(v.position.length()), f64::from(v.throughput[0]))),
        );
        each(&list);
        list.clear();
    }
}

/// Mean and standard error from sums over light sub-paths.
#[derive(Default)]
struct Sums {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn estimate(&self) -> Estimate {
        let mean = self.sum / self.count;
        Estimate { mean, error: ((self.squares / self.count - mean * mean) / (self.count - 1.0)).sqrt() }
    }
}

#[test]
fn fluence_around_a_point_source() {
    let mut table = Table::new(0.06);
    for case in cases("infinite_point_source_fluence") {
        let r = case.input("r");
        // A shell of this half-thickness; the mean of the fluence in it differs by some h²/6 of its second
        // derivative.
        let half = (0.03 * r).min(0.1);
        let volume = 4.0 / 3.0 * std::f64::consts::PI * ((r + half).powi(3) - (r - half).powi(3));
        let paths = if case.input("albedo") > 0.95 { 100_000 } else { 200_000 };
        let expected = case.expected(&["fluence"]);
        // Through ten mean free paths of a dark medium too few get to tell.
        if expected * volume * f64::from(paths) < 100.0 {
            continue;
        }
        let mut sums = Sums::default();
        photons(&case, paths, |photons| {
            let inside = photons.iter().filter(|(distance, _)| (distance - r).abs() < half);
            sums.add(inside.map(|(_, flux)| flux).sum::<f64>() / volume);
        });
        table.check(&case.id, sums.estimate(), expected, 3e-3 * expected);
    }
    table.finish();
}

/// The roulette changes no mean of the light that comes back from far away in a medium that absorbs nothing.
#[test]
fn lost_walks_end_without_bias() {
    /// Edges of a walk at most: it gets some thirty free paths far.
    const LONGEST: u32 = 1000;
    let returning = |roulette, paths| {
        let (mut sums, mut edges) = (Sums::default(), 0);
        photons_in(&medium(0.0, 1.0, 0.0), 1.0, roulette, LONGEST, paths, |photons| {
            edges += photons.len();
            // Photons in a shell that have been far away.
            let far = photons.iter().position(|(distance, _)| *distance > 14.0).unwrap_or(photons.len());
            let back = photons[far..].iter().filter(|(distance, _)| *distance < 6.0);
            sums.add(back.map(|(_, flux)| flux).sum());
        });
        (sums.estimate(), edges as f64 / f64::from(paths))
    };
    let (all, of_all) = returning(Roulette::Off, 25_000);
    let (some, of_some) = returning(Roulette::Below(1.0), 120_000);
    let z = (all.mean - some.mean) / all.error.hypot(some.error);
    println!("{} +- {}, {} +- {}, {of_all} and {of_some} edges", all.mean, all.error, some.mean, some.error);
    assert!(z.abs() < 4.0, "{z} standard errors");
    assert!(all.error < 0.02 * all.mean && some.error < 0.03 * some.mean, "errors tell nothing");
    assert!(of_some < 0.5 * of_all, "{of_some} of {of_all} edges");
}

#[test]
fn moments_of_a_point_source() {
    let mut table = Table::new(0.06);
    for case in cases("infinite_point_source_moments") {
        let absorption = (1.0 - case.input("albedo")) * case.input("sigma_t");
        let sigma_t = case.input("sigma_t");
        let (mut fluence, mut collisions, mut squares) = (Sums::default(), Sums::default(), Sums::default());
        photons(&case, 100_000, |photons| {
            let flux: f64 = photons.iter().map(|(_, flux)| flux).sum();
            fluence.add(flux);
            collisions.add(sigma_t * flux);
            squares.add(photons.iter().map(|(distance, flux)| distance * distance * flux * absorption).sum());
        });
        let expected = |name| case.expected(&[name]);
        let id = &case.id;
        table.check(
            &format!("{id} integral of the fluence"),
            fluence.estimate(),
            expected("integral_of_fluence_over_space"),
            case.accuracy,
        );
        table.check(
            &format!("{id} collisions"),
            collisions.estimate(),
            expected("mean_number_of_collisions"),
            case.accuracy,
        );
        table.check(
            &format!("{id} mean square distance"),
            squares.estimate(),
            expected("mean_square_distance_of_absorption"),
            case.accuracy,
        );
    }
    table.finish();
}
