//! Rooms that are closed shapes.

use upbp_core::Settings;
use upbp_core::check::check_scene;
use upbp_scene::ReadyScene;

/// Radiance in a sphere of radius R and albedo ρ around a light of intensity I is `ρ I / (π R² (1 − ρ))`
/// everywhere, by camera and by light sub-paths.
#[test]
fn light_in_an_integrating_sphere_is_even() {
    let text = "(version: 1, camera: Perspective(origin: (0, 0, 1), target: (0, 0, 0), fov_degrees: 40),
        film: (width: 8, height: 8), materials: { \"white\": Lambert(0.9) },
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 2), material: \"white\")],
        lights: [Point(position: (0, 0, 0), intensity: 1)])";
    let scene = ReadyScene::from_ron_str(text, "").unwrap_or_else(|error| panic!("{error}"));
    check_scene(&scene).unwrap();
    let expected = 0.9 / (std::f64::consts::PI * 4.0 * 0.1);
    for techniques in ["pt", "bpt"] {
        let settings = Settings { techniques: techniques.parse().unwrap(), ..Settings::default() };
        let mut renderer = scene.renderer(settings.validate().unwrap()).unwrap();
        for _ in 0..256 {
            assert!(renderer.iterate());
        }
        let mean = renderer.film().image().mean()[1];
        assert!((mean / expected - 1.0).abs() < 0.02, "{techniques}: {mean} instead of {expected}");
        assert_eq!(renderer.report().counters.lost_walks, 0);
    }
}
