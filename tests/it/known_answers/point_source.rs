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
    IterationChoices, IterationPlan, Kernel, Kernels, MergePeriods, PathLengths, PreparedScene, RadiusField,
    Roulette, StreamKind,
};

use upbp_testing::Estimate;
use upbp_testing::analytic::{Case, Table, cases, medium, narrow_camera, scene};

/// Distances and fluxes of the photons of each light sub-path of a source of power 1.
fn photons(case: &Case, paths: u32, mut each: impl FnMut(&[(f64, f64)])) {
    let sigma_t = case.input("sigma_t");
    let albedo = case.input("albedo");
    let intensity = 0.25 * std::f64::consts::FRAC_1_PI * case.input("power");
    let scene = scene(&format!(
        "{} outside: \"m\", media: {{\"m\": {}}}, lights: [Point(position: (0.0, 0.0, 0.0), intensity: {intensity:?})],",
        narrow_camera([10.0, 0.0, 0.0], [0.0; 3], 1),
        medium((1.0 - albedo) * sigma_t, albedo * sigma_t, case.optional("g").unwrap_or(0.0)),
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
            lengths: PathLengths { min: 1, max: 1_000_000 },
            roulette: Roulette::Below(1.0),
            kernels: Kernels { pp3d: Kernel::ball(0.1), ..Kernels::NONE },
            radius_field: RadiusField::Uniform,
            heuristic: Heuristic::Balance,
            photon_beams: BeamExtent::Short,
            query_beams: BeamExtent::Long,
            lanes: None,
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
    let mut table = Table::default();
    for case in cases("infinite_point_source_fluence") {
        let r = case.input("r");
        // A shell of this half-thickness; the mean of the fluence in it differs by some h²/6 of its second
        // derivative.
        let half = (0.03 * r).min(0.1);
        let volume = 4.0 / 3.0 * std::f64::consts::PI * ((r + half).powi(3) - (r - half).powi(3));
        let mut sums = Sums::default();
        let paths = if case.input("albedo") > 0.95 { 100_000 } else { 600_000 };
        photons(&case, paths, |photons| {
            let inside = photons.iter().filter(|(distance, _)| (distance - r).abs() < half);
            sums.add(inside.map(|(_, flux)| flux).sum::<f64>() / volume);
        });
        let expected = case.expected(&["fluence"]);
        table.check(&case.id, sums.estimate(), expected, 3e-3 * expected);
    }
    table.finish();
}

#[test]
fn moments_of_a_point_source() {
    let mut table = Table::default();
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
