//! Starts of rays on, or within rounding of, the boundary of a body.

mod support;

use support::render;
use upbp_core::Settings;
use upbp_scene::ReadyScene;

fn scene(text: &str) -> ReadyScene {
    match ReadyScene::from_ron_str(text, "") {
        Ok(scene) => scene,
        Err(error) => panic!("{error}\n{text}"),
    }
}

fn settings(techniques: &str) -> Settings {
    Settings { techniques: techniques.parse().expect("technique names"), ..Settings::default() }
}

/// A glowing cube of side 2 that a narrow camera looks into from `(0, 0, z)`.
fn glow(z: f32) -> f64 {
    let scene = scene(&format!(
        "(version: 1, camera: Perspective(origin: (0.0, 0.0, {z:?}), target: (0.0, 0.0, {:?}), fov_degrees: 0.01),
        film: (width: 4, height: 4), media: {{\"m\": Homogeneous(sigma_a: 0.5, emission: 1.0)}}, materials: {{\"null\": Null}},
        shapes: [(geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"m\")])",
        z - 1.0
    ));
    render(&scene, &settings("hit"), 2).0.mean
}

#[test]
fn a_camera_on_a_boundary_looks_into_the_body() {
    let through = 1.0 - (-1.0_f64).exp();
    for z in [3.0, 1.0_f32.next_up(), 1.0, 1.0_f32.next_down()] {
        assert!((glow(z) - through).abs() < 1e-5, "z = {z}: {} instead of {through}", glow(z));
    }
    // On the far side, looking away from it.
    assert_eq!(glow(-1.0), 0.0);
}

#[test]
fn a_camera_on_a_boundary_is_inside_even_if_no_ray_gets_out() {
    let mean = |z: f32| {
        let scene = scene(&format!(
            "(version: 1, camera: Perspective(origin: (0.0, 0.0, {z:?}), target: (0.0, 0.0, {:?}), fov_degrees: 0.01),
            film: (width: 4, height: 4), media: {{\"m\": Homogeneous(sigma_a: 1.0)}},
            materials: {{\"null\": Null, \"black\": Lambert(0.0)}},
            shapes: [
                (geometry: Box(min: (-1, -1, -1), max: (1, 1, 1)), material: \"null\", interior: \"m\"),
                (geometry: Sphere(centre: (0, 0, 0), radius: 0.5), material: \"black\", emission: 1.0),
            ])",
            z - 1.0
        ));
        render(&scene, &settings("hit"), 2).0.mean
    };
    for z in [3.0, 1.0_f32.next_up(), 1.0, 1.0_f32.next_down()] {
        assert!((mean(z) - (-0.5_f64).exp()).abs() < 1e-5, "z = {z}: {}", mean(z));
    }
}

#[test]
fn no_walk_is_lost_where_free_paths_are_as_short_as_roundings() {
    let scene = scene(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 40),
        film: (width: 16, height: 16), media: {\"m\": Homogeneous(sigma_s: 5e5)}, materials: {\"null\": Null},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\")],
        lights: [Constant(1)])",
    );
    let settings = Settings { max_length: 200, ..settings("hit") };
    let mut renderer = scene.renderer(settings.validate().expect("valid settings")).expect("a scene");
    for _ in 0..16 {
        renderer.iterate();
    }
    let counters = renderer.report().counters;
    assert_eq!(counters.lost_walks, 0);
    // Nothing absorbs: whoever is not cut sees the light.
    let [mean, ..] = renderer.film().image().mean();
    let cut = counters.cut_walks as f64 / (16.0 * 256.0);
    assert!((mean + cut - 1.0).abs() < 1e-5, "{mean} + {cut}");
}

#[test]
fn kernels_wider_than_a_free_path_do_not_darken_a_boundary() {
    let scene = scene(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 30),
        film: (width: 12, height: 12), media: {\"m\": Homogeneous(sigma_a: 5e4, sigma_s: 4.5e5)}, materials: {\"null\": Null},
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"null\", interior: \"m\")],
        lights: [Constant(1)])",
    );
    let (expected, _) = render(&scene, &settings("hit"), 64);
    let (found, _) = render(&scene, &settings("all"), 16);
    let slack = 5.0 * found.error.hypot(expected.error) + 0.005;
    assert!((found.mean - expected.mean).abs() < slack, "{found:?} {expected:?}");
}
