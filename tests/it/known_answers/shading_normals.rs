//! Irradiance on a smoothly shaded mesh: facets have the cosines of the shading normal, whatever their own.

use upbp_core::{LightPaths, Settings};
use upbp_testing::analytic::{Table, narrow_camera, scene, settings};
use upbp_testing::render;

#[test]
fn facets_that_light_grazes_are_as_bright_as_the_next() {
    // A ridge of two facets whose shading normals point up, under light that grazes the left one. Seen at
    // the edge, half of the disc of the kernel lies on either, and photons are fifteen times as dense on the
    // right one.
    let (slope, light) = (8.0_f64.to_radians(), 9.15_f64.to_radians());
    let (albedo, irradiance) = (0.8, 2.0);
    let mesh = format!(
        "Mesh(positions: [(0, 0, {w}), (0, 0, -{w}), (-{w}, {y:?}, {w}), (-{w}, {y:?}, -{w}), ({w}, {y:?}, {w}), ({w}, {y:?}, -{w})],
        normals: [(0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)],
        indices: [(0, 1, 2), (2, 1, 3), (0, 4, 1), (1, 4, 5)])",
        w = 0.2,
        y = -0.2 * slope.tan(),
    );
    let expected = albedo / std::f64::consts::PI * irradiance * light.sin();
    let mut table = Table::default();
    let ridge = scene(&format!(
        "{} materials: {{\"grey\": Lambert({albedo:?})}},
        shapes: [(geometry: {mesh}, material: \"grey\")],
        lights: [Directional(direction: ({:?}, {:?}, 0), irradiance: {irradiance:?})],",
        narrow_camera([0.0, 3.0, 0.0], [0.0; 3], 1),
        -light.cos(),
        -light.sin(),
    ));
    for (techniques, iterations) in [("nee", 2), ("surf", 60)] {
        let settings = Settings {
            light_paths: LightPaths::Count(50_000),
            min_length: 2,
            max_length: 2,
            ..settings(techniques, Some(0.1))
        };
        let (result, _) = render(&ridge, &settings, iterations);
        // The bend makes at most 0.02 % of the kernel's area.
        table.check(techniques, result, expected, 2e-4 * expected);
    }
    table.finish();
}
