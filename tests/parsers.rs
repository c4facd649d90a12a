//! What is read from files, with files that are nearly right and with noise: an error or a result, never a panic.

use proptest::prelude::*;
use upbp_core::{Renderer, Settings};
use upbp_scene::obj::ObjMesh;
use upbp_scene::{ReadyScene, SceneDescription};

const SCENES: [&str; 3] = [
    include_str!("../examples/scenes/cornell_media.ron"),
    include_str!("../examples/scenes/glass_and_null.ron"),
    r#"(version: 1, camera: Perspective(origin: (0, 1, 3), target: (0, 1, 0), fov_degrees: 40, lens_radius: 0.1),
    film: (width: 8, height: 8, crop: (x: 1, y: 1, width: 4, height: 4)), outside: "haze",
    media: { "m": Homogeneous(sigma_a: 0.1, sigma_s: (0.5, 1, 2), phase: Blend([(1, Rayleigh), (2, HenyeyGreenstein(0.9))])),
        "haze": Homogeneous(sigma_s: 0.01, emission: 0.1) },
    materials: { "white": Lambert(0.7), "null": Null, "metal": Metal(alpha: 0.1, reflectance: 0.9), "glass": Dielectric(ior: 1.5) },
    shapes: [
        (name: "floor", material: "white", geometry: Quad(origin: (-2, 0, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0))),
        (material: "null", interior: "m", priority: 3, geometry: Sphere(centre: (0, 1, 0), radius: 0.5)),
        (material: "glass", geometry: Box(min: (-1, 0, -1), max: (-0.5, 1, -0.5))),
        (material: "metal", geometry: Mesh(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], indices: [(0, 1, 2)], scale: 2), emission: 1),
    ],
    lights: [Point(position: (0, 3, 0), intensity: (5, 5, 5)), Spot(position: (0, 2, 1), target: (0, 0, 0), intensity: 1, cutoff_degrees: 20)])"#,
];

const SETTINGS: &str = "(techniques: \"bpt+surf+pp3d\", seed: 7, light_paths: Count(100), beams: 10, connections: 2, min_length: 1, \
    max_length: 12, roulette: false, heuristic: Power, photon_beams: Long, radii: (pb2d: Absolute(0.1), surf: Scene(1e-3)), \
    progressive: false, memory: 64)";

const MESH: &str = "# a mesh\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\ng name\nf 1//1 2//1 3//1\nf -4 -2 -1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n";

/// What takes the place of a piece.
const PIECES: [&str; 24] = [
    "",
    "0",
    "-1",
    "1e38",
    "-1e-45",
    "1e999",
    "NaN",
    "inf",
    "-inf",
    "4294967296",
    "18446744073709551616",
    "(",
    ")",
    "[",
    "}",
    "\"",
    ",",
    ":",
    "None",
    "()",
    "Some(1)",
    "\u{0}",
    "\u{1F4A1}",
    "//",
];

/// Changes of a text: at a place, take away some bytes, put a piece or a part of the text itself.
fn changes() -> impl Strategy<Value = Vec<(usize, usize, usize, bool)>> {
    prop::collection::vec((any::<usize>(), 0_usize..12, any::<usize>(), any::<bool>()), 1..6)
}

fn change(text: &str, changes: &[(usize, usize, usize, bool)]) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for &(place, length, piece, copy) in changes {
        // Where words and numbers begin, mostly: a change inside of a word is a typo and no more.
        let starts: Vec<usize> = (1..bytes.len())
            .filter(|&i| bytes[i].is_ascii_alphanumeric() && !bytes[i - 1].is_ascii_alphanumeric())
            .collect();
        let start = if starts.is_empty() { 0 } else { starts[place % starts.len()] };
        let end = bytes[start..]
            .iter()
            .position(|b| !(b.is_ascii_alphanumeric() || *b == b'.' || *b == b'-'))
            .map_or(bytes.len(), |i| start + i);
        let end = (end + length.saturating_sub(9)).min(bytes.len());
        let new = if copy {
            let from = piece % bytes.len();
            bytes[from..(from + 40).min(bytes.len())].to_vec()
        } else {
            PIECES[piece % PIECES.len()].as_bytes().to_vec()
        };
        bytes.splice(start..end, new);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Reads a scene; one that is accepted is written, read again, and a little of it rendered.
fn read_scene(text: &str) {
    let Ok(mut description) = SceneDescription::from_ron(text) else { return };
    let written = description.to_ron().expect("what was read can be written");
    assert_eq!(SceneDescription::from_ron(&written).expect("what was written can be read"), description);
    description.film = upbp_scene::description::Film {
        width: upbp_scene::description::Count::new(3).expect("a size"),
        height: upbp_scene::description::Count::new(2).expect("a size"),
        crop: None,
    };
    let Ok(scene) = ReadyScene::build(&description, "no/such/folder") else { return };
    let settings = Settings {
        techniques: "all".parse().expect("technique names"),
        light_paths: upbp_core::LightPaths::Count(8),
        max_length: 6,
        ..Settings::default()
    };
    if let Ok(mut renderer) = Renderer::new(&scene, settings.validate().expect("valid settings")) {
        renderer.iterate();
        let fine = |value: &f32| value.is_finite() && *value >= 0.0;
        assert!(renderer.film().image().pixels.iter().flatten().all(fine), "{text}");
    }
}

fn read_settings(text: &str) {
    if let Ok(settings) = Settings::from_ron(text) {
        let _ = settings.validate();
    }
}

fn read_mesh(text: &str) {
    if let Ok(mesh) = ObjMesh::parse(text) {
        let _ = upbp_accel::TriangleMesh::new(mesh.positions, mesh.indices, mesh.normals);
    }
}

fn read_image(bytes: &[u8]) {
    // A file for each thread: tests run at the same time.
    let name = format!("image_{:?}.exr", std::thread::current().id());
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).expect("a writable folder");
    let _ = upbp_scene::light::EnvironmentImage::load(&path);
    let _ = upbp_core::read_exr(&path);
    let _ = std::fs::remove_file(&path);
}

/// A good image.
fn image() -> &'static [u8] {
    static IMAGE: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
    IMAGE.get_or_init(|| {
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("seed.exr");
        exr::prelude::write_rgb_file(&path, 8, 4, |x, y| (x as f32, y as f32, 1.0_f32))
            .expect("a writable folder");
        std::fs::read(&path).expect("the file")
    })
}

/// Files per test; `PROPTEST_CASES` asks for another number.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1000)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn scenes_that_are_nearly_right(which in 0..SCENES.len(), changes in changes()) {
        read_scene(&change(SCENES[which], &changes));
    }

    #[test]
    fn settings_that_are_nearly_right(changes in changes()) {
        read_settings(&change(SETTINGS, &changes));
    }

    #[test]
    fn meshes_that_are_nearly_right(changes in changes()) {
        read_mesh(&change(MESH, &changes));
    }

    #[test]
    fn noise(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let text = String::from_utf8_lossy(&bytes);
        read_scene(&text);
        read_settings(&text);
        read_mesh(&text);
        read_image(&bytes);
    }

    #[test]
    fn images_that_are_nearly_right(
        changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..8),
        end in any::<usize>(),
        cut in any::<bool>(),
    ) {
        let mut bytes = image().to_vec();
        for (place, value) in changes {
            let length = bytes.len();
            bytes[place % length] = value;
        }
        if cut {
            bytes.truncate(end % bytes.len());
        }
        read_image(&bytes);
    }
}

#[test]
fn what_nests_deeply_is_refused() {
    for depth in [10, 100, 1000, 100_000] {
        let phase = "Blend([(1, ".repeat(depth) + "Isotropic" + &")])".repeat(depth);
        let text = SCENES[2].replace("Rayleigh", &phase);
        let _ = SceneDescription::from_ron(&text);
        let _ = Settings::from_ron(&"(".repeat(depth));
        let _ = SceneDescription::from_ron(&"[".repeat(depth));
    }
}
