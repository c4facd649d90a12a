//! Bodies in layers, in a white furnace: liquid in glass on ice, thin walls, bubbles, a camera inside.
//!
//! Nothing absorbs, so that radiance over the square of the index is 1 everywhere. Faces are shared, or
//! bodies overlap as priorities allow.

use upbp_core::{Roulette, Settings};
use upbp_scene::ReadyScene;
use upbp_testing::{Estimate, iterate, render, renderer};

/// Part that merges may lose at boundaries, where a kernel sticks out of its medium.
const BOUNDARY_LOSS: f64 = 0.005;
/// Part that interpolation in the tables of rough glass may lose or add.
const TABLES: f64 = 2e-3;
/// Roundings of indices in the throughput of a path.
const ROUNDING: f64 = 1e-5;
/// Sets of techniques: camera sub-paths alone, connections, and everything.
const TECHNIQUES: [&str; 3] = ["pt", "bpt", "all"];

/// Shapes in layers.
struct Layers {
    name: &'static str,
    shapes: String,
    camera: &'static str,
    /// Index of refraction at the camera.
    ior: f64,
}

fn layers(name: &'static str, shapes: String) -> Layers {
    Layers { name, shapes, camera: "origin: (2.2, 3.1, 4.3), target: (0.0, 0.9, 0.0)", ior: 1.0 }
}

fn cuboid(min: [f64; 3], max: [f64; 3], rest: &str) -> String {
    let [a, b] = [min, max].map(|corner| format!("({:?}, {:?}, {:?})", corner[0], corner[1], corner[2]));
    format!("(geometry: Box(min: {a}, max: {b}), {rest}),\n")
}

fn ball(centre: [f64; 3], radius: f64, rest: &str) -> String {
    let [x, y, z] = centre;
    format!("(geometry: Sphere(centre: ({x:?}, {y:?}, {z:?}), radius: {radius:?}), {rest}),\n")
}

const ICE: &str = "material: \"ice\", interior: \"ice\"";
const GLASS: &str = "material: \"glass\", priority: 2";
const WATER: &str = "material: \"water\", interior: \"water\"";
const AIR: &str = "material: \"air\", priority: 1";

/// Ice, glass and water, one above the other.
fn stack() -> String {
    let layer = |y: f64, rest: &str| cuboid([-1.0, y, -1.0], [1.0, y + 0.6, 1.0], rest);
    layer(0.0, ICE) + &layer(0.6, "material: \"glass\"") + &layer(1.2, WATER)
}

/// A slab of ice below `y = 0`, larger than what stands on it.
fn slab() -> String {
    cuboid([-1.4, -0.5, -1.3], [1.5, 0.0, 1.4], ICE)
}

/// A glass on `y = 0` whose floor and walls touch at the edges, with a hollow of 1.2 a side.
fn vessel(thickness: f64) -> String {
    let (inner, outer) = (0.6, 0.6 + thickness);
    let wall = |min, max| cuboid(min, max, GLASS);
    wall([-outer, 0.0, -outer], [outer, thickness, outer])
        + &wall([-outer, thickness, -outer], [-inner, 1.5, outer])
        + &wall([inner, thickness, -outer], [outer, 1.5, outer])
        + &wall([-inner, thickness, -outer], [inner, 1.5, -inner])
        + &wall([-inner, thickness, inner], [inner, 1.5, outer])
}

/// The liquid in a [`vessel`], which reaches into floor and walls by `overlap`.
fn liquid(thickness: f64, overlap: f64) -> String {
    let side = 0.6 + overlap;
    cuboid([-side, thickness - overlap, -side], [side, 1.1, side], WATER)
}

/// Bubbles: alone, two that overlap, one that touches the wall, and one cut by the surface of the liquid.
fn bubbles() -> String {
    [([0.1, 0.6, 0.1], 0.2), ([0.25, 0.7, 0.2], 0.15), ([-0.4, 0.5, 0.0], 0.2), ([-0.2, 1.1, 0.3], 0.15)]
        .map(|(centre, radius)| ball(centre, radius, AIR))
        .concat()
}

fn all_layers() -> Vec<Layers> {
    let on_ice = |thickness: f64, overlap: f64| slab() + &vessel(thickness) + &liquid(thickness, overlap);
    let under_water = Layers {
        camera: "origin: (0.3, 0.8, 0.4), target: (-0.2, 0.9, 0.0)",
        ior: 1.33,
        ..layers("under water", on_ice(0.15, 0.0) + &bubbles())
    };
    let in_the_wall = Layers {
        camera: "origin: (0.7, 0.8, 0.1), target: (-0.2, 0.9, 0.0)",
        ior: 1.5,
        ..layers("inside of the glass", on_ice(0.15, 0.0))
    };
    vec![
        layers("stack", stack()),
        layers("liquid in glass on ice", on_ice(0.15, 0.0)),
        layers("liquid that overlaps its glass, on ice", on_ice(0.15, 0.05)),
        layers("thin walls", on_ice(4e-3, 0.0)),
        layers("bubbles", on_ice(0.15, 0.0) + &bubbles()),
        under_water,
        in_the_wall,
    ]
}

/// A scene of side about 3; `scattering` per unit, without absorption.
fn scene(layers: &Layers, scattering: [f64; 2], size: u32) -> ReadyScene {
    let [water, ice] = scattering;
    let text = format!(
        "(version: 1, camera: Perspective({}, fov_degrees: 38.0),
          film: (width: {size}, height: {size}),
          media: {{ \"water\": Homogeneous(sigma_s: {water:?}), \"ice\": Homogeneous(sigma_s: {ice:?}) }},
          materials: {{ \"ice\": Dielectric(1.31), \"glass\": Dielectric(1.5), \"water\": Dielectric(1.33), \"air\": Dielectric(1.0), \"frosted\": RoughDielectric(alpha: 0.1, ior: 1.5) }},
          shapes: [{}],
          lights: [Constant(1)])",
        layers.camera, layers.shapes
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{}: {error}", layers.name))
}

/// Light that runs along a thin wall is reflected thousands of times.
fn settings(techniques: &str) -> Settings {
    let techniques = techniques.parse().expect("technique names");
    Settings { techniques, max_length: 20_000, ..Settings::default() }
}

#[test]
fn clear_layers_are_not_seen() {
    for layers in all_layers() {
        let scene = scene(&layers, [0.0, 0.0], 48);
        // Some run along the walls by hundreds of reflections.
        let mut renderer = renderer(&scene, Settings { roulette: Some(Roulette::Off), ..settings("pt") });
        for _ in 0..8 {
            assert!(renderer.iterate());
        }
        let counters = renderer.report().counters;
        assert_eq!((counters.lost_walks, counters.boundary_conflicts), (0, 0), "{}", layers.name);
        // Not a mean: every path carries the same light.
        for value in renderer.film().image().pixels.iter().flatten() {
            let radiance = f64::from(*value) / layers.ior.powi(2);
            assert!((radiance - 1.0).abs() < ROUNDING, "{}: {radiance}", layers.name);
        }
    }
}

#[test]
fn scattering_layers_keep_their_energy() {
    for layers in all_layers() {
        let scene = scene(&layers, [1.0, 0.5], 24);
        for techniques in TECHNIQUES {
            let (means, _) = iterate(&scene, &settings(techniques), 24);
            let radiance: Vec<f64> =
                means.iter().map(|mean| mean.iter().sum::<f64>() / (3.0 * layers.ior.powi(2))).collect();
            let found = Estimate::of(&radiance);
            let slack = if techniques == "all" { BOUNDARY_LOSS } else { 0.0 };
            let case = format!("{}, {techniques}", layers.name);
            println!("{case}: {:.5} ± {:.5}", found.mean, found.error);
            assert!((found.mean - 1.0).abs() < 4.0 * found.error + slack + ROUNDING, "{case}: {found:?}");
            assert!(found.error < 0.01, "{case}: too noisy to tell");
        }
    }
}

/// A rough vessel, filled: its liquid shares its faces, or reaches into them.
#[test]
fn rough_layers_are_the_same_by_all_techniques() {
    let rough = |overlap: f64| {
        let shapes = slab() + &vessel(0.15) + &liquid(0.15, overlap);
        let layers = layers("rough", shapes.replace("\"glass\"", "\"frosted\""));
        scene(&layers, [1.0, 0.5], 24)
    };
    let (expected, _) = render(&rough(0.05), &settings("pt"), 96);
    for (overlap, techniques) in [(0.0, "pt"), (0.0, "bpt"), (0.0, "all"), (0.05, "bpt")] {
        let (found, _) = render(&rough(overlap), &settings(techniques), 96);
        let case = format!("overlap {overlap}, {techniques}");
        println!("{case}: {found:?}, expected {expected:?}");
        let slack = if techniques == "all" { BOUNDARY_LOSS } else { 0.0 };
        let error = found.error.hypot(expected.error);
        assert!((found.mean - expected.mean).abs() < 4.0 * error + slack, "{case}: {found:?} {expected:?}");
        assert!(error < 0.01 * expected.mean, "{case}: too noisy to tell");
    }
}

/// Rough glass around a medium, which fills it.
fn rough_ball(alpha: f64, scattering: f64) -> ReadyScene {
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 5), target: (0, 0, 0), fov_degrees: 16),
          film: (width: 16, height: 16), media: {{ \"m\": Homogeneous(sigma_s: {scattering:?}) }},
          materials: {{ \"frosted\": RoughDielectric(alpha: {alpha:?}, ior: 1.5) }},
          shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"frosted\", interior: \"m\")],
          lights: [Constant(1)])"
    );
    ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}"))
}

/// Facets lose nothing to each other: white by all techniques, up to the tables of what they send around.
#[test]
fn rough_glass_is_white() {
    for alpha in [0.05, 0.3, 1.0] {
        for scattering in [0.0, 2.0] {
            let scene = rough_ball(alpha, scattering);
            for techniques in TECHNIQUES {
                let iterations = if techniques == "all" { 24 } else { 64 };
                let (found, _) = render(&scene, &settings(techniques), iterations);
                let case = format!("alpha {alpha}, scattering {scattering}, {techniques}");
                println!("{case}: {:.5} ± {:.5}", found.mean, found.error);
                let slack = TABLES + if techniques == "all" { BOUNDARY_LOSS } else { 0.0 };
                assert!((found.mean - 1.0).abs() < 4.0 * found.error + slack, "{case}: {found:?}");
                assert!(found.error < 0.015, "{case}: too noisy to tell");
            }
        }
    }
}
