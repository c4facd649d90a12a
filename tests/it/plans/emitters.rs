//! The choice of emitters for light sub-paths.

use upbp_core::{FrozenPlan, Heuristic, LightPaths, Settings, Start, Technique, TechniqueSet, Techniques};
use upbp_scene::ReadyScene;
use upbp_testing::shipped::Shipped;
use upbp_testing::{renderer, short_renderer};

/// A dim sky, and three lamps, one as bright as the others, each in a hollow ball of opal glass; all in thin
/// fog. Little of their light is found by camera sub-paths, and bright contributions are rare.
fn opal_lamps() -> ReadyScene {
    let ball = |x: f32, z: f32, radius: f32| {
        let (y, hollow) = (radius + 0.002, 0.85 * radius);
        format!(
            r#"(material: "opal", interior: "opal", geometry: Sphere(centre: ({x}, {y}, {z}), radius: {radius})),
    (material: "air", geometry: Sphere(centre: ({x}, {y}, {z}), radius: {hollow})),
    (material: "black", emission: 150, geometry: Sphere(centre: ({x}, {y}, {z}), radius: 0.05)),"#
        )
    };
    let balls = [ball(-1.2, 0.0, 0.4), ball(0.1, -0.5, 0.5), ball(1.2, 0.4, 0.35)].concat();
    let text = format!(
        r#"(
  version: 1,
  camera: Perspective(origin: (0, 1.6, 4.5), target: (0, 0.5, 0), fov_degrees: 40),
  film: (width: 96, height: 54),
  media: {{
    "opal": Homogeneous(sigma_a: (0.02, 0.05, 0.1), sigma_s: (12, 11, 10), phase: HenyeyGreenstein(0.4)),
    "fog": Homogeneous(sigma_a: 0.01, sigma_s: 0.15, phase: HenyeyGreenstein(0.6)),
  }},
  materials: {{
    "ground": Phong(diffuse: 0.3, specular: 0.2, exponent: 300), "black": Lambert(0),
    "opal": Dielectric(1.5), "air": Dielectric(1), "gas": Null,
  }},
  shapes: [
    (material: "ground", geometry: Quad(origin: (-20, 0, -20), edge_u: (0, 0, 40), edge_v: (40, 0, 0))),
    (material: "gas", interior: "fog", geometry: Box(min: (-19, 0.0005, -19), max: (19, 5, 19))),
    {balls}
  ],
  lights: [Constant(0.01)],
)"#
    );
    ReadyScene::from_ron_str(&text, ".").expect("a valid scene")
}

/// Shares of light sub-paths of a render of one iteration, by emitter.
fn shares(scene: &ReadyScene, seed: u64) -> Vec<f64> {
    let settings = Settings { seed, ..Settings::default() };
    shares_of(&short_renderer(scene, settings, 1).state().identity().frozen_plan())
}

fn shares_of(plan: &FrozenPlan) -> Vec<f64> {
    let text = plan.to_ron();
    let (_, rest) = text.split_once("emission: [").expect("the choice of emitters");
    let (ends, _) = rest.split_once(']').expect("the end of a list");
    let ends: Vec<f64> = ends.split(',').map(|end| end.trim().parse().expect("a number")).collect();
    let starts = std::iter::once(0.0).chain(ends.iter().copied());
    starts.zip(&ends).map(|(start, end)| (end - start) / f64::from(1 << 24)).collect()
}

/// A lamp that light sub-paths hardly ever choose has beams a hundred times as bright as those of the others.
#[test]
fn of_lamps_that_are_alike_none_is_left_to_chance() {
    let scene = opal_lamps();
    for seed in 0..6 {
        let shares = shares(&scene, seed);
        let lamps = &shares[1..];
        assert_eq!(lamps.len(), 3);
        assert!(lamps.iter().all(|&share| share > 0.1), "{seed}: {shares:?}");
    }
}

/// Two lamps, each in a ball of glass, on either side of a wall: the light of one falls on stone, which is
/// seen through a pane, that of the other into fog. Photons of the first are few in each kernel, and bright.
fn stone_and_fog() -> ReadyScene {
    let text = r#"(
  version: 1,
  camera: Perspective(origin: (0, 0, 6), target: (0, 0, 0), fov_degrees: 40),
  film: (width: 64, height: 36),
  media: { "fog": Homogeneous(sigma_s: 1.5) },
  materials: {
    "stone": Lambert(0.6), "black": Lambert(0), "glass": Dielectric(1.5), "gas": Null,
  },
  shapes: [
    (material: "stone", geometry: Quad(origin: (-3, -2, -1), edge_u: (2.98, 0, 0), edge_v: (0, 4, 0))),
    (material: "black", geometry: Quad(origin: (0.02, -2, -1), edge_u: (2.98, 0, 0), edge_v: (0, 4, 0))),
    (material: "black", geometry: Box(min: (-0.02, -3, -1), max: (0.02, 3, 3))),
    (material: "glass", geometry: Box(min: (-4, -3, 2), max: (-0.021, 3, 2.1))),
    (material: "gas", interior: "fog", geometry: Box(min: (0.03, -2, -0.99), max: (3, 2, 1.5))),
    (material: "glass", geometry: Sphere(centre: (-1.2, 0, 0.2), radius: 0.1)),
    (material: "glass", geometry: Sphere(centre: (1.2, 0, 0.2), radius: 0.1)),
  ],
  lights: [Point(position: (-1.2, 0, 0.2), intensity: 1), Point(position: (1.2, 0, 0.2), intensity: 1)],
)"#;
    ReadyScene::from_ron_str(text, ".").expect("a valid scene")
}

fn by_photons() -> Settings {
    Settings {
        techniques: "hit+nee+lt+surf+pb2d".parse().expect("a set"),
        light_paths: LightPaths::Count(30_000),
        ..Settings::default()
    }
}

/// Variance of renders with a plan, relative to the light of a pixel and of the picture.
fn relative_variance(scene: &ReadyScene, plan: &FrozenPlan) -> f64 {
    const SEEDS: u32 = 6;
    let image = |seed| -> Vec<f64> {
        let settings = Settings { seed, ..by_photons() }.validate().expect("valid settings");
        let start = Start { plan: Some(plan.clone()), ..Start::default() };
        let mut renderer = scene.start_renderer(settings, start).expect("a plan for it");
        (0..2).for_each(|_| assert!(renderer.iterate()));
        renderer.film().image().pixels.iter().map(|[r, g, b]| f64::from(r + g + b)).collect()
    };
    let images: Vec<_> = (0..u64::from(SEEDS)).map(image).collect();
    let pixels = images[0].len();
    let mean = images.iter().flatten().sum::<f64>() / (f64::from(SEEDS) * pixels as f64);
    let of_pixel = |i: usize| {
        let light = images.iter().map(|image| image[i]).sum::<f64>() / f64::from(SEEDS);
        images.iter().map(|image| ((image[i] - light) / (light + mean)).powi(2)).sum::<f64>()
    };
    (0..pixels).map(of_pixel).sum()
}

#[test]
fn light_sub_paths_are_shared_so_that_the_error_is_least() {
    let scene = stone_and_fog();
    let renderer = renderer(&scene, Settings { deterministic: true, ..by_photons() });
    let chosen = renderer.state().identity().frozen_plan();
    let own = shares_of(&chosen)[0];
    let with = |share: f64| {
        let text = chosen.to_ron();
        let (before, rest) = text.split_once("emission: [").expect("the choice of emitters");
        let (_, after) = rest.split_once(']').expect("the end of a list");
        let (end, all) = ((share * f64::from(1 << 24)) as u32, 1 << 24);
        FrozenPlan::from_ron(&format!("{before}emission: [{end}, {all}]{after}")).expect("a plan")
    };
    let found = relative_variance(&scene, &chosen);
    let others = [0.2, 0.5, 0.8, 0.95].map(|share| (share, relative_variance(&scene, &with(share))));
    println!("share {own}: {found}, others {others:?}");
    let least = others.iter().map(|&(_, variance)| variance).fold(f64::INFINITY, f64::min);
    assert!(found < 1.3 * least, "share {own}: {found}, others {others:?}");
    // In proportion to light it would be less than this.
    assert!(others[0].1 > 2.0 * least, "the share matters: {others:?}");
}

/// Weights tell what emitters bring, and those of the power heuristic do not.
#[test]
fn emitters_are_chosen_alike_whichever_heuristic_a_render_has() {
    let text = r#"(
  version: 1,
  camera: Perspective(origin: (0, 1.2, 4), target: (0, 0.4, 0), fov_degrees: 40),
  film: (width: 96, height: 54, crop: (x: 16, y: 9, width: 64, height: 36)),
  media: { "flame": Homogeneous(glow: 20), "haze": Homogeneous(glow: 0.1) },
  materials: { "stone": Lambert(0.6), "glass": Dielectric(1.5), "gas": Null },
  shapes: [
    (material: "stone", geometry: Quad(origin: (-5, 0, -5), edge_u: (0, 0, 10), edge_v: (10, 0, 0))),
    (material: "glass", geometry: Sphere(centre: (0.5, 0.31, 0), radius: 0.3)),
    (material: "gas", interior: "haze", geometry: Box(min: (-2, 0.001, -2), max: (-1, 0.5, 2))),
    (material: "gas", interior: "flame", geometry: Sphere(centre: (-0.5, 0.5, 0), radius: 0.08)),
    (material: "stone", emission: 5, geometry: Sphere(centre: (1.5, 1, -1), radius: 0.2)),
  ],
  lights: [Constant(0.1)],
)"#;
    let scene = ReadyScene::from_ron_str(text, ".").expect("a valid scene");
    let emitters = |heuristic| {
        let settings = Settings { heuristic, deterministic: true, ..by_photons() };
        renderer(&scene, settings).state().identity().frozen_plan().emitters
    };
    assert_eq!(emitters(Heuristic::Power), emitters(Heuristic::Balance));
}

/// Techniques that a plan has not got leave what they find to the others: emitters are those of a render that
/// was given the techniques of the plan.
#[test]
fn emitters_are_chosen_for_the_techniques_of_the_plan() {
    let scene = Shipped::find("many_lights").expect("a shipped scene").scene();
    let scene = ReadyScene::load(scene).expect("a valid scene");
    let plan = |techniques| {
        let settings = Settings { techniques, deterministic: true, ..Settings::default() };
        renderer(&scene, settings).state().identity().frozen_plan()
    };
    let auto = plan(Techniques::Auto);
    let chosen = auto.plan.techniques;
    assert!(chosen.has(Technique::LightTracing) && !chosen.has(Technique::Bb1d), "{chosen}");
    assert_eq!(auto.emitters, plan(chosen.into()).emitters);
    assert_ne!(auto.emitters, plan(TechniqueSet::STANDARD.into()).emitters);
}
