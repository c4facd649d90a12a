//! Layers for denoisers against closed forms: walls seen directly, by a mirror and through glass, a medium.

use upbp_core::{FeatureImages, Roulette, Settings, TechniqueSet};
use upbp_testing::{analytic, renderer};

/// Features of what a camera at the origin sees along −z.
fn features(scene: &str, iterations: u32) -> FeatureImages {
    features_with(Roulette::Off, scene, iterations)
}

fn features_with(roulette: Roulette, scene: &str, iterations: u32) -> FeatureImages {
    let scene = analytic::scene(&(analytic::narrow_camera([0.0; 3], [0.0, 0.0, -1.0], 4) + scene));
    let techniques = TechniqueSet::PT.into();
    let roulette = Some(roulette);
    let settings = Settings { techniques, roulette, features: true, ..Settings::default() };
    let mut renderer = renderer(&scene, settings);
    (0..iterations).for_each(|_| {
        renderer.iterate();
    });
    renderer.film().features().expect("settings ask for features")
}

/// Asserts that all pixels have these values, up to the angle of the camera.
fn assert_all(features: &FeatureImages, albedo: [f64; 3], normal: [f64; 3], depth: f64) {
    let close = |a: f32, b: f64| f64::from(a) == b || (f64::from(a) - b).abs() < 2e-3 * b.abs().max(1.0);
    for (pixel, &distance) in features.depth.iter().enumerate() {
        let found = (features.albedo.pixels[pixel], features.normal.pixels[pixel], distance);
        let is_close = (0..3).all(|c| close(found.0[c], albedo[c]) && close(found.1[c], normal[c]));
        assert!(is_close && close(distance, depth), "{found:?}, not {albedo:?}, {normal:?}, {depth}");
    }
}

const MATERIALS: &str = "materials: {\"red\": Lambert((0.6, 0.3, 0.1)), \"mirror\": Mirror(0.5), \
                         \"null\": Null, \"still\": Dielectric(1.0), \"lamp\": Lambert(0.0)}";
/// Something that shines, behind the camera.
const LIGHT: &str = "lights: [Point(position: (0, 0, 0.5), intensity: 1)]";

#[test]
fn a_wall_is_seen_as_it_is() {
    // Its back as well as its front.
    for edges in ["edge_u: (2, 0, 0), edge_v: (0, 2, 0)", "edge_u: (0, 2, 0), edge_v: (2, 0, 0)"] {
        let wall = format!("(geometry: Quad(origin: (-1, -1, -3), {edges}), material: \"red\")");
        let features = features(&format!("{MATERIALS}, shapes: [{wall}], {LIGHT}"), 2);
        assert_all(&features, [0.6, 0.3, 0.1], [0.0, 0.0, 1.0], 3.0);
    }
}

#[test]
fn mirrors_and_clear_boundaries_are_looked_through() {
    // The mirror turns −z to +x; the wall faces it, and a body of the index of what is around is on the way.
    let mirror =
        "(geometry: Quad(origin: (-1, -1, -1), edge_u: (2, 0, -2), edge_v: (0, 2, 0)), material: \"mirror\")";
    let wall =
        "(geometry: Quad(origin: (5, -4, -8), edge_u: (0, 0, 12), edge_v: (0, 8, 0)), material: \"red\")";
    let body = "(geometry: Box(min: (2, -1, -3), max: (3, 1, -1)), material: \"still\")";
    let scene = format!("{MATERIALS}, shapes: [{mirror}, {wall}, {body}], {LIGHT}");
    assert_all(&features(&scene, 2), [0.3, 0.15, 0.05], [-1.0, 0.0, 0.0], 7.0);

    // Roulette ends half of the walks at the mirror, of which nothing is seen: not the mirror.
    let iterations = 2000;
    let features = features_with(Roulette::Below(1.0), &scene, iterations);
    let five_errors = 5.0 * 0.5 / f64::from(iterations).sqrt();
    for (pixel, &depth) in features.depth.iter().enumerate() {
        let [albedo, normal] = [&features.albedo, &features.normal].map(|image| image.pixels[pixel]);
        assert!((f64::from(albedo[0]) - 0.3).abs() < 0.6 * five_errors, "{albedo:?}");
        assert!((f64::from(normal[0]) + 0.5).abs() < five_errors && normal[1] == 0.0, "{normal:?}");
        assert!((depth - 7.0).abs() < 2e-2, "{depth}");
    }
}

#[test]
fn a_lamp_is_its_light_and_nothing_is_nothing() {
    let lamp = "(geometry: Quad(origin: (-1, -1, -2), edge_u: (2, 0, 0), edge_v: (0, 2, 0)), material: \"lamp\", \
                emission: (0.25, 0.5, 4.0))";
    let features_of_lamp = features(&format!("{MATERIALS}, shapes: [{lamp}]"), 2);
    assert_all(&features_of_lamp, [0.25, 0.5, 1.0], [0.0, 0.0, 1.0], 2.0);
    let aside =
        "(geometry: Quad(origin: (5, -1, -2), edge_u: (2, 0, 0), edge_v: (0, 2, 0)), material: \"red\")";
    let nothing = features(&format!("{MATERIALS}, shapes: [{aside}], {LIGHT}"), 2);
    assert_all(&nothing, [0.0; 3], [0.0; 3], f64::INFINITY);
}

#[test]
fn a_medium_has_an_albedo_and_no_normal() {
    let media = "media: {\"fog\": Homogeneous(sigma_a: 1.0, sigma_s: 3.0)}";
    let body = "(geometry: Box(min: (-1, -1, -9), max: (1, 1, -2)), material: \"null\", interior: \"fog\")";
    let features = features(&format!("{media}, {MATERIALS}, shapes: [{body}], {LIGHT}"), 4000);
    // The first scattering lies a mean free path behind the boundary. Standard error of a pixel: 0.25/√4000.
    for (pixel, &depth) in features.depth.iter().enumerate() {
        let albedo = features.albedo.pixels[pixel];
        assert!(albedo.iter().all(|a| (a - 0.75).abs() < 1e-3), "{albedo:?}");
        assert!(features.normal.pixels[pixel].iter().all(|n| n.abs() < 1e-3));
        assert!((f64::from(depth) - 2.25).abs() < 5.0 * 0.25 / 4000.0_f64.sqrt(), "{depth}");
    }
}
