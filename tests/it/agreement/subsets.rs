//! Every set of techniques that covers a scene renders the same picture (`docs/theory.md`, section 9, items 7
//! and 8), in the scene with everything that weights and factors can go wrong on.
//!
//! Compared are means over the whole film, path by path: sums of thousands of pixels show a missing factor of
//! a per cent, which single pixels hide in their noise.

use std::num::NonZeroU32;

use glam::Vec3;
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::observer::{NoObserver, ObservedSample, ObservedVertex, Observer};
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::scene::{Bsdf, Scene};
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{
    Counters, IterationChoices, IterationPlan, Kernel, Kernels, LightMap, MergePeriods, NO_LIMIT,
    PathLengths, PreparedScene, RadiusField, Roulette, Spectrum, StreamKind, Technique, TechniqueSet,
};
use upbp_media::Lanes;

use upbp_testing::closed_form::scene::ClosedForm;

pub(crate) const SIZE: u32 = 48;

/// Iterations of a set.
const ITERATIONS: u64 = 20;

/// Iterations where merges find light beside other techniques: they do more, at a lower variance.
const ITERATIONS_WITH_MERGES: u64 = 10;

pub(super) fn choices(techniques: &str, lengths: PathLengths, seed: u64) -> IterationChoices {
    let radius = 0.02;
    IterationChoices {
        seed,
        iteration: 0,
        techniques: techniques.parse().expect("names"),
        light_paths: SIZE * SIZE,
        beam_paths: SIZE * SIZE / 2,
        connections: 1.0,
        next_events: 1.0,
        camera_factor: 1.0,
        periods: MergePeriods::ONE,
        vertices_per_light_path: 2.3,
        lengths,
        roulette: Roulette::Below(0.6),
        kernels: Kernels {
            surf: Kernel::disc(radius),
            pp3d: Kernel::ball(2.0 * radius),
            pb2d: Kernel::parabolic_disc(radius),
            bp2d: Kernel::parabolic_disc(radius),
            bb1d: Kernel::parabolic_line(radius),
        },
        radius_field: RadiusField::Uniform,
        mean_free_paths: NO_LIMIT,
        heuristic: Heuristic::Balance,
        photon_beams: BeamExtent::Short,
        query_beams: BeamExtent::Long,
        lanes: None,
        features: false,
    }
}

/// Mean of the film in one iteration.
fn iteration<S: Scene>(scene: &S, choices: &IterationChoices) -> f64 {
    if choices.lanes.is_some() {
        iteration_in::<_, [f64; 3]>(scene, choices)
    } else {
        iteration_in::<_, f64>(scene, choices)
    }
}

fn iteration_in<S: Scene, L: Lanes>(scene: &S, choices: &IterationChoices) -> f64 {
    let world = PreparedScene::new(scene).expect("the scene is in order");
    let plan = IterationPlan::new(scene, choices);
    let context = Context { prepared: &world, plan: &plan };
    let mut scratch = Scratch::default();
    let mut chunk = LightChunk::<_, f64, L>::default();
    let nobody = &mut NoObserver;
    if plan.needs_light_paths() {
        for index in 0..plan.light_paths {
            trace_light_path(&context, StreamKind::Light, index, &mut scratch, &mut chunk, nobody);
        }
    }
    assert!(chunk.beams.iter().all(|beam| beam.path < plan.beam_paths), "other paths leave no beams");
    let mut sum: f64 = chunk.splats.iter().map(|splat| f64::from(splat.value.mean())).sum();
    let map = LightMap::build(&plan, chunk.vertices, chunk.beams);
    let mut counters = Counters::default();
    for index in 0..SIZE * SIZE {
        let pixel = [index % SIZE, index / SIZE];
        let stream = plan.stream(StreamKind::Camera, u64::from(index));
        let walk = trace_camera_path(&context, &map, stream, pixel, &mut scratch, &mut counters, nobody);
        sum += walk.layers.iter().map(|layer| f64::from(layer.mean())).sum::<f64>();
    }
    assert_eq!(counters.dropped, 0);
    sum / f64::from(SIZE * SIZE)
}

fn merges(techniques: TechniqueSet) -> bool {
    !techniques.without(TechniqueSet::BPT).is_empty()
}

/// Mean and standard error over the iterations.
pub(super) fn mean<S: Scene>(scene: &S, choices: &IterationChoices) -> (f64, f64) {
    let others = choices.techniques.intersection(TechniqueSet::BPT);
    let beside_others = merges(choices.techniques) && !others.is_empty();
    let count = if beside_others { ITERATIONS_WITH_MERGES } else { ITERATIONS };
    mean_of_blocks(scene, choices, count, 1)
}

/// Mean and standard error over so many blocks of `block` iterations.
fn mean_of_blocks<S: Scene>(scene: &S, choices: &IterationChoices, count: u64, block: u64) -> (f64, f64) {
    let one = |i| iteration(scene, &IterationChoices { iteration: i, ..choices.clone() });
    let mean_of = |first: u64| (first..first + block).map(one).sum::<f64>() / block as f64;
    let values: Vec<f64> = (0..count).map(|i| mean_of(block * i)).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Compares sets of techniques with the first one.
fn agree(camera: Vec3, powers: [f32; 5], lengths: PathLengths, sets: &[&str]) {
    let mut scene = ClosedForm::new(camera, SIZE);
    for (light, power) in scene.lights.iter_mut().zip(powers) {
        light.power = power;
    }
    // A light that is never chosen must not be hit either.
    for object in &mut scene.objects {
        object.emitter = object.emitter.filter(|emitter| powers[emitter.0 as usize] > 0.0);
    }
    agree_in(&scene, lengths, sets);
}

/// The most that means of these sets may differ: four standard errors, and half a per cent where there are
/// merges, which is more than kernels of this size blur.
fn tolerance(sets: [&str; 2], expected: f64, sigma: f64) -> f64 {
    let blurs = |set: &str| merges(set.parse().expect("names"));
    4.0 * sigma + if sets.into_iter().any(blurs) { 0.005 * expected } else { 0.0 }
}

/// Compares sets of techniques with the first one, within the [`tolerance`], in any scene.
pub(crate) fn agree_in<S: Scene>(scene: &S, lengths: PathLengths, sets: &[&str]) {
    let mut reference = None;
    for (seed, techniques) in sets.iter().enumerate() {
        let (mean, error) = mean(scene, &choices(techniques, lengths, 100 + seed as u64));
        let (expected, expected_error) = *reference.get_or_insert((mean, error));
        let sigma = error.hypot(expected_error);
        println!("{techniques:30} {mean:.5} ± {error:.5}, {:+.2} %", 100.0 * (mean / expected - 1.0));
        let tolerance = tolerance([sets[0], techniques], expected, sigma);
        assert!((mean - expected).abs() <= tolerance, "{techniques}: {mean}, expected {expected} ± {sigma}");
        assert!(sigma < 0.04 * expected, "{techniques}: too noisy to tell, {sigma} of {expected}");
    }
}

const OUTSIDE: Vec3 = Vec3::new(0.2, 0.3, 3.0);
const IN_FOG: Vec3 = Vec3::new(0.1, 0.4, 1.0);

/// Lights that can be hit: emission hits cover all paths.
const HITTABLE: [f32; 5] = [3.0, 1.5, 0.0, 0.0, 2.0];

/// Adds up the light that a camera sub-path meets before the first vertex that can be connected.
#[derive(Default)]
struct Seen {
    light: Spectrum,
    /// The most edges of a path that brought some of it.
    depth: u32,
    scattered: bool,
}

impl<B: Bsdf> Observer<B> for Seen {
    type Densities = f64;

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        self.scattered |= vertex.interaction.is_connectible();
    }

    fn sample(&mut self, sample: &ObservedSample<B, f64>) {
        if sample.technique == Technique::Hit && !self.scattered {
            self.light += sample.value * sample.weight.value() as f32;
            self.depth = self.depth.max(sample.camera_depth);
        }
    }
}

#[test]
fn light_is_seen_up_to_the_first_vertex_that_scatters() {
    let scene = ClosedForm::new(OUTSIDE, SIZE);
    let world = PreparedScene::new(&scene).expect("the scene is in order");
    let plan = IterationPlan::new(&scene, &choices("hit+nee", PathLengths { min: 1, max: 6 }, 7));
    let context = Context { prepared: &world, plan: &plan };
    let map = LightMap::<_, f64, f64>::build(&plan, Vec::new(), Vec::new());
    let (mut scratch, mut counters) = (Scratch::default(), Counters::default());
    let (mut deepest, mut less_than_all) = (0, 0);
    for index in 0..SIZE * SIZE {
        let (pixel, mut seen) = ([index % SIZE, index / SIZE], Seen::default());
        let stream = plan.stream(StreamKind::Camera, u64::from(index));
        let walk = trace_camera_path(&context, &map, stream, pixel, &mut scratch, &mut counters, &mut seen);
        let difference = (walk.seen.mean() - seen.light.mean()).abs();
        assert!(difference <= 1e-5 * seen.light.mean(), "{pixel:?}: {:?}, {:?}", walk.seen, seen.light);
        deepest = deepest.max(seen.depth);
        less_than_all += u32::from(walk.layers[0].mean() > walk.seen.mean());
    }
    assert!(deepest > 1 && less_than_all > 100, "{deepest}, {less_than_all}");
}

#[test]
fn each_technique_beside_hits() {
    let lengths = PathLengths { min: 1, max: 6 };
    let sets = [
        "hit+nee",
        "hit",
        "hit+connect",
        "hit+lt",
        "hit+surf",
        "hit+pp3d",
        "hit+pb2d",
        "hit+bp2d",
        "hit+bb1d",
        "bpt",
        "all",
    ];
    agree(OUTSIDE, HITTABLE, lengths, &sets);
}

#[test]
fn each_technique_beside_hits_of_volumes() {
    let lengths = PathLengths { min: 2, max: 6 };
    for (camera, sets) in [
        (OUTSIDE, &["hit+nee", "hit", "hit+lt", "hit+connect", "hit+surf", "hit+pp3d", "all"][..]),
        (IN_FOG, &["hit+nee", "hit", "hit+lt", "hit+pb2d", "hit+bp2d", "hit+bb1d", "bpt", "all"]),
    ] {
        let mut scene = ClosedForm::glowing(camera, SIZE);
        scene.lights[..5].iter_mut().for_each(|light| light.power = 0.0);
        scene.objects.iter_mut().for_each(|object| object.emitter = None);
        agree_in(&scene, lengths, sets);
    }
}

#[test]
fn a_camera_in_a_medium() {
    let lengths = PathLengths { min: 1, max: 6 };
    agree(IN_FOG, HITTABLE, lengths, &["hit+nee", "hit", "bpt", "hit+surf", "all"]);
}

#[test]
fn lights_that_are_never_hit() {
    // Point and directional: single scattering, with nothing in between that bends.
    let lengths = PathLengths { min: 2, max: 2 };
    let sets = ["nee+lt", "lt", "nee+surf+pp3d+pb2d+bp2d+bb1d", "surf+pb2d", "surf+bb1d"];
    agree(OUTSIDE, [0.0, 0.0, 2.0, 1.0, 0.0], lengths, &sets);
}

#[test]
fn periods_and_other_counts() {
    let scene = ClosedForm::new(OUTSIDE, SIZE);
    let usual = choices("all", PathLengths { min: 1, max: 6 }, 200);
    let other = IterationChoices {
        seed: 201,
        next_events: 1.4,
        camera_factor: 4.0,
        connections: 0.4,
        periods: MergePeriods::from_fn(|technique| NonZeroU32::new(1 + technique as u32 % 3).unwrap()),
        ..usual.clone()
    };
    let (expected, expected_error) = mean(&scene, &usual);
    // Of periods of one, two and three, each of which has one turn.
    let (found, error) = mean_of_blocks(&scene, &other, 7, 6);
    let sigma = error.hypot(expected_error);
    println!("{found:.5} ± {error:.5}, expected {expected:.5} ± {expected_error:.5}");
    assert!((found - expected).abs() < 4.0 * sigma, "{found}, expected {expected} ± {sigma}");
    assert!(sigma < 0.02 * expected, "too noisy to tell: {sigma} of {expected}");
}

#[test]
fn lanes_and_mixtures() {
    // Glowing bodies, which sub-paths in lanes start at, meet on their way, and look for.
    let mut scene = ClosedForm::glowing(IN_FOG, SIZE);
    scene.lights[..5].iter_mut().for_each(|light| light.power = 0.0);
    scene.objects.iter_mut().for_each(|object| object.emitter = None);
    let lengths = PathLengths { min: 2, max: 6 };
    let (expected, expected_error) = mean(&scene, &choices("hit+nee", lengths, 300));
    for (seed, set) in (301..).zip(["hit", "hit+nee", "bpt", "all"]) {
        let lanes = Some([0.5, 0.2, 0.3]);
        let (found, error) = mean(&scene, &IterationChoices { lanes, ..choices(set, lengths, seed) });
        let sigma = error.hypot(expected_error);
        println!("{set}: {found:.5} ± {error:.5}, expected {expected:.5} ± {expected_error:.5}");
        let tolerance = tolerance(["hit+nee", set], expected, sigma);
        assert!((found - expected).abs() <= tolerance, "{set}: {found}, expected {expected} ± {sigma}");
        assert!(sigma < 0.04 * expected, "{set}: too noisy to tell, {sigma} of {expected}");
    }
}

#[test]
fn path_lengths_add_up() {
    // The whole is the sum of its parts, for a set that reaches each length in several ways.
    let scene = ClosedForm::new(OUTSIDE, SIZE);
    let of = |min, max, seed| mean(&scene, &choices("bpt+surf+pb2d", PathLengths { min, max }, seed));
    let (whole, error) = of(1, 5, 1);
    let parts = [of(1, 2, 2), of(3, 3, 3), of(4, 5, 4)];
    let sum: f64 = parts.iter().map(|part| part.0).sum();
    let sigma = parts.iter().map(|part| part.1).fold(error, f64::hypot);
    println!("{whole:.5} ± {error:.5}, sum of parts {sum:.5}");
    assert!((sum - whole).abs() < 4.0 * sigma, "{sum}, expected {whole} ± {sigma}");
    assert!(sigma < 0.03 * whole, "too noisy to tell: {sigma} of {whole}");
}
