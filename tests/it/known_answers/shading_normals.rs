//! Irradiance on a smoothly shaded mesh: facets have the cosines of the shading normal, whatever their own.

use std::f64::consts::PI;

use upbp_core::{LightPaths, Settings};
use upbp_scene::ReadyScene;
use upbp_testing::analytic::{Table, narrow_camera, scene, settings};
use upbp_testing::render;

const ALBEDO: f64 = 0.8;
const IRRADIANCE: f64 = 2.0;

/// Two facets with one edge whose shading normals point up. They fall off by so many degrees on both sides,
/// light comes from the right at an elevation in degrees, and the camera looks down at a place near the edge.
fn facets(fall: f64, elevation: f64, seen: f64) -> ReadyScene {
    let (low, width) = (-0.2 * fall.to_radians().tan(), 0.2);
    let (sin, cos) = elevation.to_radians().sin_cos();
    scene(&format!(
        "{} materials: {{\"grey\": Lambert({ALBEDO:?})}},
        shapes: [(material: \"grey\", geometry: Mesh(
            positions: [(0, 0, {width}), (0, 0, -{width}), (-{width}, {low}, {width}),
                (-{width}, {low}, -{width}), ({width}, {low}, {width}), ({width}, {low}, -{width})],
            normals: [(0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)],
            indices: [(0, 1, 2), (2, 1, 3), (0, 4, 1), (1, 4, 5)],
        ))],
        lights: [Directional(direction: ({:?}, {:?}, 0), irradiance: {IRRADIANCE:?})],",
        narrow_camera([seen, 3.0, 0.0], [seen, 0.0, 0.0], 1),
        -cos,
        -sin,
    ))
}

/// Compares what next events and surface merges with a radius see with a radiance.
fn check(scene: &ReadyScene, radius: f64, expected: f64) {
    let mut table = Table::new(0.01);
    for (techniques, iterations) in [("nee", 2), ("surf", 60)] {
        let settings = Settings {
            light_paths: LightPaths::Count(50_000),
            min_length: 2,
            max_length: 2,
            ..settings(techniques, Some(radius))
        };
        let (result, _) = render(scene, &settings, iterations);
        // The bend makes at most 0.02 % of the kernel's area.
        table.check(techniques, result, expected, 2e-4 * expected);
    }
    table.finish();
}

#[test]
fn facets_that_light_grazes_are_as_bright_as_the_next() {
    // A ridge, the left side of which light grazes: photons are fifteen times as dense on the right one. Seen
    // at the edge, half of the kernel's disc lies on either.
    let elevation = 9.15_f64;
    check(&facets(8.0, elevation, 0.0), 0.1, ALBEDO / PI * IRRADIANCE * elevation.to_radians().sin());
}

#[test]
fn light_behind_the_next_facet_does_not_count() {
    // A valley, the right side of which is lit from behind and shades 0.067 of the left one, which is seen.
    check(&facets(-8.0, 4.0, -0.01), 0.05, 0.0);
}
