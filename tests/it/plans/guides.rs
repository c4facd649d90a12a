//! Small things in large places: light sub-paths are guided to them.

use std::sync::Arc;

use glam::Vec3;
use upbp_core::{Settings, Start, Stop, TechniqueSet, Techniques};
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::scene::{Emitter, EmitterId, Scene};
use upbp_estimators::{
    EmissionGuide, EmissionSample, EmitterChoice, EmitterChoiceError, IterationChoices, IterationPlan,
    Kernel, Kernels, MergePeriods, NO_LIMIT, PathLengths, PreparedScene, RadiusField, Roulette,
};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, channels, renderer, short_renderer};

/// A glass ball of radius 0.2 under some light, on a square of stone amid black ground of some size: were it
/// of stone, what the ball shows of it would depend on its size.
fn ball(size: f32, light: &str) -> ReadyScene {
    let half = 0.5 * size;
    let text = format!(
        r#"(
  version: 1,
  camera: Perspective(origin: (0.9, 0.8, 1.6), target: (0.1, 0.1, 0.05), fov_degrees: 40),
  film: (width: 64, height: 64, crop: (x: 20, y: 30, width: 20, height: 12)),
  materials: {{ "stone": Lambert(0.5), "black": Lambert(0), "glass": Dielectric(1.5) }},
  shapes: [
    (material: "stone", geometry: Quad(origin: (-1.5, 0, -1.5), edge_u: (0, 0, 3), edge_v: (3, 0, 0))),
    (material: "black", geometry: Quad(origin: (-{half}, -0.01, -{half}), edge_u: (0, 0, {size}), edge_v: ({size}, 0, 0))),
    (material: "glass", geometry: Sphere(centre: (0, 0.2, 0), radius: 0.2)),
  ],
  lights: [ {light} ],
)"#
    );
    ReadyScene::from_ron_str(&text, std::env::temp_dir()).expect("a valid scene")
}

/// The shadow with the caustic in it, of some seeds.
struct Shadow {
    means: [Estimate; 3],
    /// From the first to the last decile of the means over all channels: a bright path that one seed meets
    /// says nothing.
    spread: f64,
}

fn shadow(scene: &ReadyScene, techniques: Techniques) -> Shadow {
    const SEEDS: usize = 24;
    const ITERATIONS: u64 = 16;
    let means: Vec<[f64; 3]> = (0..SEEDS as u64)
        .map(|seed| {
            let settings = Settings { seed, techniques, ..Settings::default() };
            let mut renderer = short_renderer(scene, settings, ITERATIONS);
            (0..ITERATIONS).for_each(|_| assert!(renderer.iterate()));
            renderer.film().image().mean()
        })
        .collect();
    let mut sorted: Vec<f64> = means.iter().map(|mean| mean.iter().sum::<f64>() / 3.0).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let spread = sorted[SEEDS - 1 - SEEDS / 10] - sorted[SEEDS / 10];
    Shadow { means: channels(&means), spread }
}

/// Of the light sub-paths of the sun, the part that meets the ball on the large ground is 10⁻⁴ of that on the
/// small one: by themselves they would make a hundred times the error.
#[test]
fn the_caustic_of_small_glass_does_not_depend_on_the_size_of_the_ground() {
    for techniques in [Techniques::Set(TechniqueSet::BPT), Techniques::Auto] {
        let sun = "Directional(direction: (0.5, -1, 0.3), irradiance: 6)";
        let [small, large] = [3.0, 300.0].map(|size| shadow(&ball(size, sun), techniques));
        assert!(large.spread < 2.0 * small.spread, "{techniques:?}: {} and {}", small.spread, large.spread);
        assert_same(small.means, large.means, 0.015, "small and large ground");
    }
}

/// As above, with a sun of one pixel of a sky: where a start has to be to meet the ball depends on the
/// direction, unless all discs are centred at the ball.
#[test]
fn the_caustic_of_a_sun_in_a_sky_does_not_depend_on_the_size_of_the_ground() {
    let file = format!("upbp-sky-{}.exr", std::process::id());
    let path = std::env::temp_dir().join(&file);
    let sky = |x: usize, y: usize| if (x, y) == (80, 12) { (9e3, 9e3, 8e3) } else { (0.2, 0.3_f32, 0.5) };
    exr::prelude::write_rgb_file(&path, 128, 64, sky).expect("a temporary file");
    let sky = format!("Image(file: {file:?})");
    let [small, large] = [3.0, 300.0].map(|size| ball(size, &sky));
    std::fs::remove_file(&path).expect("it was there");
    let [small, large] = [small, large].map(|scene| shadow(&scene, Techniques::Auto));
    assert!(large.spread < 2.0 * small.spread, "{} and {}", small.spread, large.spread);
}

/// A preparation without any time still looks at enough to meet what is a twentieth of the picture, and what
/// it found stays as long as nothing speaks against it.
#[test]
fn small_glass_is_found_without_time() {
    let scene = ball(300.0, "Directional(direction: (0.5, -1, 0.3), irradiance: 6)");
    for seed in 0..24 {
        let settings = Settings { seed, ..Settings::default() }.validate().expect("valid settings");
        let stop = Stop { seconds: Some(1e-6), ..Stop::default() };
        let start = Start { stop, ..Start::default() };
        let renderer = scene.start_renderer(settings, start).expect("a valid render");
        let emitters = renderer.state().identity().frozen_plan().emitters;
        assert!(emitters.guide(EmitterId(0)).is_some(), "seed {seed}");
    }
}

/// The sun through three windows, one of which the camera hardly sees, into a large dusty room.
fn windows() -> ReadyScene {
    let wall = |z: [f32; 2], y: [f32; 2]| {
        let [[z0, z1], [y0, y1]] = [z, y];
        format!(r#"(material: "stone", geometry: Box(min: (4, {y0}, {z0}), max: (4.2, {y1}, {z1}))),"#)
    };
    let window = |z: f32, stain: &str| {
        let end = z + 1.6;
        format!(
            r#"(material: "glass", interior: "{stain}", geometry: Box(min: (4.05, 2.5, {z}), max: (4.1, 6, {end}))),"#
        )
    };
    let pillars =
        [[-10.2, -6.0], [-4.4, -2.0], [-0.4, 2.0], [3.6, 10.2]].map(|z| wall(z, [2.5, 6.0])).concat();
    let beams = [[-0.2, 2.5], [6.0, 8.2]].map(|y| wall([-10.2, 10.2], y)).concat();
    let windows = [window(-6.0, "red"), window(-2.0, "blue"), window(2.0, "gold")].concat();
    let text = format!(
        r#"(
  version: 1,
  camera: Perspective(origin: (-2.5, 2, 8), target: (0.5, 2.5, 0), fov_degrees: 55),
  film: (width: 640, height: 360),
  media: {{
    "dust": Homogeneous(sigma_a: 0.002, sigma_s: 0.03, phase: HenyeyGreenstein(0.5)),
    "red": Homogeneous(sigma_a: (1, 40, 60)), "blue": Homogeneous(sigma_a: (60, 30, 2)),
    "gold": Homogeneous(sigma_a: (1, 8, 60)),
  }},
  materials: {{ "stone": Lambert(0.4), "glass": Dielectric(1.5), "gas": Null }},
  shapes: [
    (material: "gas", interior: "dust", geometry: Box(min: (-3.9, 0.01, -9.9), max: (3.9, 7.9, 9.9))),
    (material: "stone", geometry: Box(min: (-4.2, -0.2, -10.2), max: (4.2, 0, 10.2))),
    (material: "stone", geometry: Box(min: (-4.2, 8, -10.2), max: (4.2, 8.2, 10.2))),
    (material: "stone", geometry: Box(min: (-4.2, 0, -10.2), max: (-4, 8, 10.2))),
    (material: "stone", geometry: Box(min: (-4, 0, -10.2), max: (4, 8, -10))),
    (material: "stone", geometry: Box(min: (-4, 0, 10), max: (4, 8, 10.2))),
    {pillars} {beams} {windows}
  ],
  lights: [ Directional(direction: (-1, -0.7, 0.15), irradiance: 60), Constant((1, 1.2, 1.6)) ],
)"#
    );
    ReadyScene::from_ron_str(&text, ".").expect("a valid scene")
}

/// Light through a part of a window that few starts are led to is bright and rare: discs all over the
/// picture, as of lamps out of focus. What a guide is learnt from differs from seed to seed; of 48, eleven
/// lead to the least tenth of the windows with less than a third of the usual density, and none with less
/// than a seventh.
#[test]
fn no_part_of_a_window_is_left_to_chance() {
    let scene = windows();
    let sun = EmitterId(0);
    let techniques = "hit+nee+surf+pb2d".parse().expect("techniques");
    let mut parts = [Vec::new(), Vec::new()];
    for seed in 0..9 {
        let settings = Settings { seed, techniques: Techniques::Set(techniques), ..Settings::default() };
        let renderer = renderer(&scene, Settings { deterministic: true, ..settings });
        let frozen = renderer.state().identity().frozen_plan();
        let mut prepared = PreparedScene::new(&scene).expect("a valid scene");
        prepared.set_emitter_choice(&frozen.emitters).expect("the choice of this scene");
        let density = |point: Vec3| {
            let light = &scene.emitters()[sun.0 as usize];
            let incident = light.sample_incident(prepared.emission_bounds(), point, [0.5; 2]);
            let incident = incident.expect("the sun shines everywhere");
            prepared.emission_factor(sun, &incident.point, -incident.towards_light, point)
        };
        let grid = (0..600).map(|i| [(i % 20) as f32 / 20.0 + 0.025, (i / 20) as f32 / 30.0 + 0.0167]);
        let points = [-6.0, -2.0, 2.0]
            .into_iter()
            .flat_map(|z| grid.clone().map(move |[u, v]| Vec3::new(4.1, 2.5 + 3.5 * v, z + 1.6 * u)));
        let mut densities: Vec<f32> = points.map(density).collect();
        densities.sort_unstable_by(f32::total_cmp);
        let part = |part: usize| densities[densities.len() * part / 100];
        let [rare, less, usual] = [2, 10, 50].map(part);
        println!("{seed}: {rare}, {less}, {usual}");
        assert!(usual > 8.0 && rare > usual / 20.0 && less > usual / 7.0, "{seed}: {rare}, {less}, {usual}");
        parts[0].push(rare / usual);
        parts[1].push(less / usual);
    }
    let [rare, less] = parts.map(|mut parts| *parts.select_nth_unstable_by(4, f32::total_cmp).1);
    assert!(rare > 1.0 / 8.0 && less > 1.0 / 3.0, "medians: {rare}, {less}");
}

/// Runs of few light sub-paths merge as many photon points as the whole number does, with the same weights.
#[test]
fn kernels_of_fewer_light_sub_paths_hold_as_many_photons() {
    let scene = windows();
    let whole = IterationPlan::new(
        &scene,
        &IterationChoices {
            seed: 1,
            iteration: 0,
            techniques: TechniqueSet::ALL,
            light_paths: 100_000,
            beam_paths: 5000,
            connections: 1.0,
            next_events: 1.0,
            camera_factor: 1.0,
            periods: MergePeriods::ONE,
            vertices_per_light_path: 1.0,
            lengths: PathLengths { min: 1, max: 8 },
            roulette: Roulette::Off,
            kernels: Kernels {
                surf: Kernel::disc(0.01),
                pp3d: Kernel::ball(0.02),
                pb2d: Kernel::parabolic_disc(0.03),
                bp2d: Kernel::parabolic_disc(0.04),
                bb1d: Kernel::parabolic_line(0.05),
            },
            radius_field: RadiusField::Uniform,
            mean_free_paths: NO_LIMIT,
            heuristic: Heuristic::Balance,
            photon_beams: BeamExtent::Short,
            query_beams: BeamExtent::Short,
            lanes: None,
            features: false,
        },
    );
    let photons = |plan: &IterationPlan, kernel: fn(&Kernels) -> Kernel| {
        f64::from(plan.light_paths) * kernel(&plan.kernels).effective_volume()
    };
    for light_paths in [2000, 20_000, 100_000, 300_000] {
        let blurred = whole.blurred(light_paths, 1000);
        assert_eq!((blurred.light_paths, blurred.beam_paths), (light_paths, 1000));
        assert_eq!(blurred.mis, whole.mis);
        for kernel in [|k: &Kernels| k.surf, |k: &Kernels| k.pp3d, |k: &Kernels| k.pb2d] {
            let ratio = photons(&blurred, kernel) / photons(&whole, kernel);
            // More sub-paths than the plan has do not make kernels narrower.
            let expected = f64::from(light_paths.max(whole.light_paths)) / f64::from(whole.light_paths);
            assert!((ratio / expected - 1.0).abs() < 1e-5, "{light_paths}: {ratio}, expected {expected}");
        }
        assert_eq!(blurred.kernels.bb1d, whole.kernels.bb1d);
    }
    // Not for ever wider.
    let widest = whole.blurred(10, 10).kernels;
    assert!((widest.surf.radius() / whole.kernels.surf.radius() - 10.0).abs() < 1e-5);
}

/// Own starts and those that other techniques ask for have one density only where an emitter tells the
/// numbers of its starts: a plan that was made for another one is refused.
#[test]
fn guides_of_another_kind_of_emitter_are_refused() {
    let scene = |light: &str| {
        let text = format!(
            r#"(version: 1, camera: Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40),
              materials: {{ "white": Lambert(0.5) }},
              shapes: [(material: "white", geometry: Box(min: (-1, 0, -1), max: (1, 1, 1))){light})"#
        );
        ReadyScene::from_ron_str(&text, "").expect("a valid scene")
    };
    let lamp =
        |geometry: &str| scene(&format!(", (material: \"white\", emission: 1, geometry: {geometry})]"));
    let quad = lamp("Quad(origin: (-1, 2, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2))");
    let block = lamp("Box(min: (-1, 2, -1), max: (1, 3, 1))");
    let point = scene("], lights: [Point(position: (0, 2, 0), intensity: 1)]");
    let sky = scene("], lights: [Constant(1)]");
    let scenes = [&quad, &block, &point, &sky];
    let choice = |scene, axis: usize, focus: Vec3| {
        let mut prepared = PreparedScene::new(scene).expect("a valid scene");
        let place =
            |i: u32| std::array::from_fn(|a| if a == axis { 0.1 } else { (i as f32 * 0.618).fract() });
        let samples: Vec<_> = (0..1000).map(|i| EmissionSample { at: place(i), light: 1.0 }).collect();
        let axes = std::array::from_fn(|a| a == axis);
        prepared.guide_emission(vec![EmissionGuide::fit(&samples, axes)]);
        prepared.focus_emission(focus);
        prepared.emitter_choice().clone()
    };
    let accepts = |scene, choice: &Arc<EmitterChoice>| {
        PreparedScene::new(scene).expect("a valid scene").set_emitter_choice(choice).is_ok()
    };
    let [place, direction] = [0, 3].map(|axis| choice(&quad, axis, Vec3::ZERO));
    assert_eq!(scenes.map(|scene| accepts(scene, &place)), [true, false, false, true]);
    assert_eq!(scenes.map(|scene| accepts(scene, &direction)), [true, true, true, true]);
    // Light from infinity cannot start on a disc without an end.
    assert!(accepts(&sky, &choice(&sky, 0, Vec3::X)));
    for far in [1.2e19, 1e20] {
        assert!(!accepts(&sky, &choice(&sky, 0, far * Vec3::X)), "{far}");
    }
}

/// A plan for a lamp says nothing of the flame beside it.
#[test]
fn a_choice_that_is_refused_changes_nothing() {
    let scene = |flame: &str| {
        let text = format!(
            r#"(version: 1, camera: Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40),
              media: {{ "flame": Homogeneous(glow: 1) }},
              materials: {{ "white": Lambert(0.5), "null": Null }},
              shapes: [
                (material: "white", emission: 1,
                  geometry: Quad(origin: (-1, 2, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2))),
                {flame}
              ])"#
        );
        ReadyScene::from_ron_str(&text, "").expect("a valid scene")
    };
    let lamp = scene("");
    let both =
        scene(r#"(material: "null", interior: "flame", geometry: Sphere(centre: (0, 1, 0), radius: 0.5))"#);
    let of_lamp = PreparedScene::new(&lamp).expect("a valid scene").emitter_choice().clone();
    let mut prepared = PreparedScene::new(&both).expect("a valid scene");
    let before = prepared.emitter_choice().clone();
    let refused = prepared.set_emitter_choice(&of_lamp);
    assert_eq!(refused, Err(EmitterChoiceError::Emitters { emitters: 2 }));
    assert!(prepared.has_volume_emitters() && *prepared.emitter_choice() == before);
}
