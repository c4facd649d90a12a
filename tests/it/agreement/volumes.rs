//! Bodies that emit, of all shapes and in all surroundings: sets of techniques that begin at them agree with
//! hits alone.

use upbp_estimators::PathLengths;
use upbp_estimators::scene::Scene;
use upbp_scene::ReadyScene;

use super::subsets::{SIZE, agree_in};

const LENGTHS: PathLengths = PathLengths { min: 2, max: 5 };

/// An octahedron of half the given height, around a centre.
fn octahedron(centre: [f32; 3], half: f32) -> String {
    let corner = |axis: usize, sign: f32| {
        let mut position = centre;
        position[axis] += sign * half;
        format!("({}, {}, {})", position[0], position[1], position[2])
    };
    let corners: Vec<_> = (0..6).map(|i| corner(i / 2, if i % 2 == 0 { 1.0 } else { -1.0 })).collect();
    let faces = "(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)";
    format!("Mesh(positions: [{}], indices: [{faces}])", corners.join(", "))
}

/// A floor, a wall and some bodies; `flame` is the medium that emits.
fn scene(flame: &str, bodies: &str, camera: &str) -> ReadyScene {
    let text = format!(
        "(version: 1, camera: Perspective({camera}, target: (0, 0.2, 0), fov_degrees: 60),
        film: (width: {SIZE}, height: {SIZE}),
        media: {{
            \"flame\": Homogeneous({flame}),
            \"smoke\": Homogeneous(sigma_a: 0.1, sigma_s: (0.3, 0.4, 0.5)),
            \"soot\": Homogeneous(sigma_a: 30),
        }},
        materials: {{\"null\": Null, \"grey\": Lambert(0.6), \"glass\": Dielectric(ior: 1.5)}},
        shapes: [
            (geometry: Quad(origin: (-2, -0.6, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0)), material: \"grey\"),
            (geometry: Quad(origin: (-2, -0.6, -2), edge_u: (4, 0, 0), edge_v: (0, 3, 0)), material: \"grey\"),
            {bodies}
        ])"
    );
    let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(!scene.emitters().is_empty(), "{text}");
    scene
}

fn body(geometry: &str, material: &str, medium: &str) -> String {
    format!("(geometry: {geometry}, material: \"{material}\", interior: \"{medium}\"),")
}

const OUTSIDE: &str = "origin: (0.2, 0.5, 2.6)";
const SETS: [&str; 5] = ["hit+nee", "hit", "hit+lt", "hit+surf", "all"];
const THIN: &str = "sigma_a: 0.5, emission: (3, 2, 1)";
const THICK: &str = "sigma_a: (20, 40, 80), sigma_s: 5, emission: (3, 2, 1)";
const GLOW: &str = "sigma_s: 2, glow: (3, 2, 1)";

#[test]
fn shapes_and_media() {
    let sphere = "Sphere(centre: (0, 0.3, 0), radius: 0.45)";
    for flame in [THIN, THICK, GLOW] {
        for geometry in
            [sphere, "Box(min: (-0.4, -0.2, -0.3), max: (0.3, 0.7, 0.4))", &octahedron([0.0, 0.3, 0.0], 0.7)]
        {
            println!("{flame}, {geometry}");
            agree_in(&scene(flame, &body(geometry, "null", "flame"), OUTSIDE), LENGTHS, &SETS);
        }
    }
}

#[test]
fn surroundings() {
    let sphere = |x: f32, radius: f32| format!("Sphere(centre: ({x}, 0.2, 0), radius: {radius})");
    let smoke = body("Box(min: (-1.8, -0.5, -1.8), max: (1.8, 2, 1.9))", "null", "smoke");
    let sets = ["hit+nee", "hit", "hit+lt", "hit+bb1d", "hit+pb2d", "all"];
    for (name, camera, flame, bodies) in [
        ("in smoke", OUTSIDE, THIN, smoke.clone() + &body(&sphere(0.0, 0.5), "null", "flame")),
        (
            "overlapping flames and soot",
            OUTSIDE,
            GLOW,
            smoke.clone()
                + &body(&sphere(-0.2, 0.5), "null", "flame")
                + &body(&sphere(0.3, 0.4), "null", "flame")
                + &body(&sphere(0.1, 0.2), "null", "soot"),
        ),
        (
            "the camera in the flame",
            "origin: (0.2, 0.4, 0.6)",
            GLOW,
            body(&sphere(0.0, 0.8), "null", "flame"),
        ),
        ("glass is the flame", OUTSIDE, GLOW, body(&sphere(0.0, 0.5), "glass", "flame")),
        (
            "in a glass ball",
            OUTSIDE,
            THIN,
            format!("(geometry: {}, material: \"glass\"),", sphere(0.0, 0.6))
                + &body(&sphere(0.0, 0.4), "null", "flame"),
        ),
    ] {
        println!("{name}");
        agree_in(&scene(flame, &bodies, camera), LENGTHS, &sets);
    }
}
