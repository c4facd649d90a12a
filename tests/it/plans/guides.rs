//! Small things in large places: light sub-paths are guided to them.

use upbp_core::{Settings, TechniqueSet, Techniques};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, assert_same, channels, renderer};

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
        let sun = "Directional(direction: (0.5, -1, 0.3), irradiance: 6)";
        let [small, large] = [3.0, 300.0].map(|size| shadow(&ball(size, sun), techniques));
        println!("{techniques:?}: {small:?}, {large:?}");
        for (small, large) in small.iter().zip(&large) {
            assert!(large.error < 2.0 * small.error, "{small:?}, {large:?}");
        }
        assert_same(small, large, "small and large ground");
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
    println!("{small:?}, {large:?}");
    for (small, large) in small.iter().zip(&large) {
        assert!(large.error < 2.0 * small.error, "{small:?}, {large:?}");
    }
}
