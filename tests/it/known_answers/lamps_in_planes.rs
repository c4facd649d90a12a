//! A lamp without a size in the plane of a ceiling, and a camera in the plane of a floor: neither plane hides
//! what is in it, by whatever technique.

use std::f64::consts::PI;

use upbp_core::{LightPaths, Settings};
use upbp_testing::analytic::{Table, scene, settings};
use upbp_testing::render;

const INTENSITY: f64 = 3.0;
const ALBEDO: f64 = 0.5;
/// Half the side of the square that the camera sees, three units away.
const HALF: f64 = 0.5;

/// The mean radiance of that square, lit from `height` above it and `aside` of its centre.
fn expected(height: f64, aside: f64) -> f64 {
    const CELLS: i32 = 40;
    let place = |cell: i32| HALF * ((f64::from(cell) + 0.5) / f64::from(CELLS) * 2.0 - 1.0);
    let irradiance = |x: f64, z: f64| {
        let squared = (x - aside).powi(2) + z.powi(2) + height.powi(2);
        INTENSITY * height / (squared * squared.sqrt())
    };
    let sum: f64 = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| irradiance(place(i), place(j)))).sum();
    ALBEDO / PI * sum / f64::from(CELLS * CELLS)
}

#[test]
fn what_a_lamp_or_a_camera_lies_in_does_not_hide_it() {
    let degrees = 2.0 * (HALF / 3.0).atan().to_degrees();
    let floor =
        "(geometry: Quad(origin: (-4, 0, -4), edge_u: (0, 0, 8), edge_v: (8, 0, 0)), material: \"floor\")";
    let ceiling =
        "(geometry: Quad(origin: (-4, 3, -4), edge_u: (8, 0, 0), edge_v: (0, 0, 8)), material: \"floor\")";
    let (above, below) = ("origin: (0, 3, 0), target: (0, 0, 0)", "origin: (0, 0, 0), target: (0, 3, 0)");
    let point = format!("Point(position: (0.7, 2.9, 0), intensity: {INTENSITY:?})");
    let spot = format!(
        "Spot(position: (0.7, 2.9, 0), direction: (0, -1, 0), intensity: {INTENSITY:?}, cutoff_degrees: 60)"
    );
    let black = |geometry: &str| format!("{floor}, (geometry: {geometry}, material: \"black\")");
    let quad = black("Quad(origin: (0.5, 2.9, -2), edge_u: (3, 0, 0), edge_v: (0, 0, 4))");
    let housing = black("Box(min: (0.6, 2.9, -0.1), max: (0.8, 3, 0.1))");
    let mesh = black(
        "Mesh(positions: [(0.6, 2.9, -0.3), (0.6, 2.9, 0.1), (0.9, 2.9, 0.1), (0.9, 2.9, -0.3)], \
         indices: [(0, 1, 2), (0, 2, 3)])",
    );
    let sloped = black("Quad(origin: (0.5, 2.9, -2), edge_u: (3, 0.7, 0), edge_v: (0, 0, 4))");
    let closed_mesh =
        housing.replace("(0.8, 3, 0.1)", "(0.8, 3, 0.1), rotate: [(axis: (0, 1, 0), degrees: 90)]");
    let room = black("Box(min: (-4, -1, -4), max: (4, 3.5, 4))");
    let [before, behind] = ["2.9466665", "2.946667"].map(|height| point.replace("2.9", height));
    let on_the_floor = format!("{floor}, {ceiling}");
    let mut table = Table::new(0.015);
    for (name, view, shapes, light, height) in [
        ("a lamp in a quad", above, &quad, &point, 2.9),
        ("a spot under its housing", above, &housing, &spot, 2.9),
        ("a spot under a housing that is a closed mesh", above, &closed_mesh, &spot, 2.9),
        ("a lamp in the ceiling of a box", above, &room, &point.replace("2.9", "3.5"), 3.5),
        ("a lamp in a mesh", above, &mesh, &point, 2.9),
        ("a lamp in a sloped quad, a rounding before it", above, &sloped, &before, 2.946_666_7),
        ("a lamp in a sloped quad, a rounding behind it", above, &sloped, &behind, 2.946_666_7),
        ("a camera on the floor", below, &on_the_floor, &point.replace("2.9", "1"), 2.0),
    ] {
        let scene = scene(&format!(
            "camera: Perspective({view}, up: (0, 0, 1), fov_degrees: {degrees:?}), film: (width: 8, height: 8),
             materials: {{\"floor\": Lambert({ALBEDO:?}), \"black\": Lambert(0)}},
             shapes: [{shapes}],
             lights: [{light}],"
        ));
        // One scattering: a floor beneath a ceiling has more.
        for techniques in ["nee", "lt", "bpt+surf"] {
            let settings = Settings {
                light_paths: LightPaths::Count(10_000),
                max_length: 2,
                ..settings(techniques, Some(0.05))
            };
            let (result, _) = render(&scene, &settings, 12);
            table.check(&format!("{name}, {techniques}"), result, expected(height, 0.7), 0.0);
        }
    }
    table.finish();
}
