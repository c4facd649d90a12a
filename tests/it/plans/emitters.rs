//! The choice of emitters for light sub-paths.

use upbp_core::Settings;
use upbp_scene::ReadyScene;
use upbp_testing::renderer;

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

/// Shares of light sub-paths, by emitter.
fn shares(scene: &ReadyScene, seed: u64) -> Vec<f64> {
    let settings = Settings { seed, deterministic: true, ..Settings::default() };
    let text = renderer(scene, settings).state().identity().frozen_plan().to_ron();
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
