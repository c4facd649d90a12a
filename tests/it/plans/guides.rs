//! Small things in large places: light sub-paths are guided to them.

use upbp_core::{Settings, TechniqueSet, Techniques};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, channels, renderer};

/// A glass ball of radius 0.2 in the sun, on a square ground of some size.
fn ball(size: f32) -> ReadyScene {
    let half = 0.5 * size;
    let text = format!(
        r#"(
  version: 1,
  camera: Perspective(origin: (0.9, 0.8, 1.6), target: (0.1, 0.1, 0.05), fov_degrees: 40),
  film: (width: 64, height: 64, crop: (x: 20, y: 30, width: 20, height: 12)),
  materials: {{ "stone": Lambert(0.5), "glass": Dielectric(1.5) }},
  shapes: [
    (material: "stone", geometry: Quad(origin: (-{half}, 0, -{half}), edge_u: (0, 0, {size}), edge_v: ({size}, 0, 0))),
    (material: "glass", geometry: Sphere(centre: (0, 0.2, 0), radius: 0.2)),
  ],
  lights: [ Directional(direction: (0.5, -1, 0.3), irradiance: 6) ],
)"#
    );
    ReadyScene::from_ron_str(&text, ".").expect("a valid scene")
}

/// Mean of the shadow with the caustic in it.
fn shadow(scene: &ReadyScene, techniques: Techniques) -> [Estimate; 3] {
    let means: Vec<[f64; 3]> = (0..8)
        .map(|seed| {
            let settings = Settings { seed, techniques, ..Settings::default() };
            let mut renderer = renderer(scene, Settings { deterministic: true, ..settings });
            (0..16).for_each(|_| assert!(renderer.iterate()));
            renderer.film().image().mean()
        })
        .collect();
    channels(&means)
}

/// Of the light sub-paths of the sun, the part that meets the ball on the large ground is 10⁻⁴ of that on the
/// small one: by themselves they would make a hundred times the error.
#[test]
fn the_caustic_of_small_glass_does_not_depend_on_the_size_of_the_ground() {
    for techniques in [Techniques::Set(TechniqueSet::BPT), Techniques::Auto] {
        let [small, large] = [3.0, 300.0].map(|size| shadow(&ball(size), techniques));
        println!("{techniques:?}: {small:?}, {large:?}");
        for (small, large) in small.iter().zip(&large) {
            assert!(large.error < 10.0 * small.error, "{small:?}, {large:?}");
        }
        assert_same(small, large, "small and large ground");
    }
}
