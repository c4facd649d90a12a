//! A wall in the sun, and the sun in a mirror: a disc of the sky lights a wall that all of it reaches as
//! parallel light of the same irradiance does, by whatever technique; and its radiance is seen.

use std::f64::consts::PI;

use upbp_core::{LightPaths, Settings};
use upbp_scene::ReadyScene;
use upbp_testing::analytic::{Table, narrow_camera, scene, settings};
use upbp_testing::render;

const IRRADIANCE: f64 = 2.0;
/// Degrees: wide enough to be hit by chance.
const DIAMETER: f64 = 40.0;

/// A square around the origin that the camera looks down at. The sun is 36.9 degrees from above it.
fn square(material: &str, camera: &str) -> ReadyScene {
    scene(&format!(
        "{camera} materials: {{\"square\": {material}}},
        shapes: [(geometry: Quad(origin: (-1, 0, -1), edge_u: (0, 0, 2), edge_v: (2, 0, 0)), material: \"square\")],
        lights: [Sun(direction: (-3, -4, 0), irradiance: {IRRADIANCE:?}, diameter_degrees: {DIAMETER:?})],"
    ))
}

#[test]
fn a_wall_in_the_sun_is_as_bright_as_by_parallel_light() {
    // Wide enough for light tracing, and within the square.
    let camera = "camera: Perspective(origin: (0, 3, 0), target: (0, 0, 0), up: (0, 0, 1), fov_degrees: 20), \
                  film: (width: 8, height: 8),";
    let wall = square("Lambert(0.5)", camera);
    let expected = 0.5 / PI * IRRADIANCE * 0.8;
    let mut table = Table::new(0.02);
    for techniques in ["hit", "nee", "lt", "surf", "bpt+surf"] {
        let settings = Settings { light_paths: LightPaths::Count(10_000), ..settings(techniques, Some(0.1)) };
        let (result, _) = render(&wall, &settings, 100);
        table.check(techniques, result, expected, 0.0);
    }
    table.finish();
}

#[test]
fn the_sun_is_seen_in_a_mirror() {
    let sine = (0.5 * DIAMETER).to_radians().sin();
    let radiance = 0.9 * IRRADIANCE / (PI * sine * sine);
    // In the middle, within the rim, and beside it.
    for (degrees, expected) in [(0.0, radiance), (19.0, radiance), (-19.0, radiance), (21.0, 0.0)] {
        let angle = (degrees + 3.0_f64.atan2(4.0).to_degrees()).to_radians();
        let origin = [-2.0 * angle.sin(), 2.0 * angle.cos(), 0.0];
        let mirror = square("Mirror(0.9)", &narrow_camera(origin, [0.0; 3], 4));
        let (result, _) = render(&mirror, &settings("bpt", None), 1);
        assert!((result.mean - expected).abs() < 1e-3 * radiance, "{degrees}: {result:?}, not {expected}");
    }
}
