//! Bodies that emit, of all shapes and in all surroundings: sets of techniques that begin at them agree with
//! hits alone.

use glam::Vec3;
use upbp_estimators::scene::{Emitter, EmitterId, EmitterKind, Scene};
use upbp_estimators::{EmitterSample, PathLengths, PreparedScene, Stream, StreamKind};
use upbp_scene::ReadyScene;
use upbp_testing::closed_form::scene::ClosedForm;

use super::subsets::{SIZE, agree_in, choices, mean};

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

/// A medium shines around everything, its channels to very different distances, and a flame below the floor,
/// which nothing on it sees. Points along a ray are drawn by the mean of the channels, so that the
/// light of one alone would vary.
#[test]
fn light_that_no_other_technique_finds_is_gathered_without_noise() {
    let text = "(version: 1, camera: Perspective(origin: (0, 0.01, 0), target: (0, 0, 0), up: (0, 0, 1), fov_degrees: 1),
        film: (width: 48, height: 48), outside: \"mist\",
        media: {
            \"mist\": Homogeneous(sigma_a: (1, 4, 17), glow: 1),
            \"flame\": Homogeneous(sigma_a: 0.5, emission: 3),
        },
        materials: {\"null\": Null, \"red\": Lambert((1, 0, 0))},
        shapes: [
            (geometry: Quad(origin: (-50, 0, -50), edge_u: (0, 0, 100), edge_v: (100, 0, 0)), material: \"red\"),
            (geometry: Sphere(centre: (0, -5, 0), radius: 0.5), material: \"null\", interior: \"flame\"),
        ])";
    let scene = ReadyScene::from_ron_str(text, "").unwrap_or_else(|error| panic!("{error}"));
    let (mean, error) = mean(&scene, &choices("hit+nee", PathLengths { min: 2, max: 2 }, 7));
    let expected = (-0.01_f64).exp() / 3.0;
    println!("{mean} ± {error}, expected {expected}");
    assert!(
        (mean / expected - 1.0).abs() < 1e-4 && error < 1e-4 * expected,
        "{mean} ± {error}, expected {expected}"
    );
}

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
    let sets = ["hit+nee", "hit+lt", "hit+pb2d", "all"];
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

/// Hits have the weight of one there: next events would bring the light once more.
#[test]
fn volumes_that_are_left_to_hits_are_chosen_by_no_receiver() {
    let scene = ClosedForm::glowing(Vec3::new(0.2, 0.3, 3.0), 16);
    let emitters = 0..scene.emitters().len() as u32;
    let is_volume = |id: u32| matches!(scene.emitters()[id as usize].kind(), EmitterKind::Volume(_));
    let mut world = PreparedScene::new(&scene).expect("the scene is in order");
    world.leave_out_volumes(|_| true);
    let mut stream = Stream::new(7, 0, StreamKind::Light, 0);
    let mut place = || Vec3::from([0; 3].map(|_| 3.0 * stream.uniform() - 1.5));
    let sample = |receiver| (receiver, EmitterSample { emitter: EmitterId(0), light: 1.0, others: 0.0 });
    let samples: Vec<_> = (0..1000).map(|_| sample(place())).collect();
    world.choose_by_receiver(&samples);
    for _ in 0..100 {
        let receiver = place();
        let probabilities = emitters.clone().map(|id| world.next_event_probability(receiver, EmitterId(id)));
        let probabilities: Vec<_> = probabilities.collect();
        assert!((probabilities.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{probabilities:?}");
        for (id, probability) in emitters.clone().zip(&probabilities) {
            assert!(!(is_volume(id) && *probability != 0.0), "{probabilities:?}");
        }
    }
}
