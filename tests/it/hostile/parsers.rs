//! Readers of files, with files that are nearly right and with noise: an error or a result, never a
//! panic.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use proptest::prelude::*;
use upbp_core::Settings;
use upbp_scene::{ReadyScene, SceneDescription};
use upbp_testing::readers::{little, read_mesh, read_scene, read_settings, read_state, sealed};

const SCENES: [&str; 3] = [
    include_str!("../../../examples/scenes/cornell_media.ron"),
    include_str!("../../../examples/scenes/glass_and_null.ron"),
    include_str!("../../data/parsers/everything.ron"),
];

const SETTINGS: &str = include_str!("../../data/parsers/settings.ron");

const MESH: &str = include_str!("../../data/parsers/mesh.obj");

/// Replacements of a piece of a file.
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

/// Reads an image.
fn read_image(bytes: &[u8]) {
    let path = file();
    upbp_testing::readers::read_image(bytes, &path);
    let _ = std::fs::remove_file(path);
}

/// A file for each thread of each process: tests run at the same time.
fn file() -> PathBuf {
    let name = format!("image_{}_{:?}.exr", std::process::id(), std::thread::current().id());
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// A good image.
fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let path = file();
        exr::prelude::write_rgb_file(&path, 8, 4, |x, y| (x as f32, y as f32, 1.0_f32))
            .expect("a writable folder");
        let bytes = std::fs::read(&path).expect("the file");
        let _ = std::fs::remove_file(path);
        bytes
    })
}

/// A good state.
fn state() -> &'static [u8] {
    static STATE: OnceLock<Vec<u8>> = OnceLock::new();
    STATE.get_or_init(|| {
        let scene = ReadyScene::from_ron_str(SCENES[2], "").expect("a good scene");
        let mut renderer = scene.renderer(little().validate().expect("valid settings")).expect("a renderer");
        renderer.iterate();
        let mut bytes = Vec::new();
        renderer.state().write(&mut bytes).expect("a vector takes all");
        bytes
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
    fn states_whose_header_is_nearly_right(changes in changes()) {
        let length = u32::from_le_bytes(state()[12..16].try_into().expect("four bytes")) as usize;
        let header = str::from_utf8(&state()[16..16 + length]).expect("text");
        let changed = change(header, &changes);
        read_state(&sealed(&[&state()[..16], changed.as_bytes(), &state()[16 + length..]].concat()));
    }

    #[test]
    fn states_whose_sums_are_nearly_right(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = state().to_vec();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        read_state(&bytes);
        read_state(&sealed(&bytes));
    }

    #[test]
    fn noise(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let text = String::from_utf8_lossy(&bytes);
        read_scene(&text);
        read_settings(&text);
        read_mesh(&text);
        read_image(&bytes);
        read_state(&bytes);
        read_state(&sealed(&bytes));
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
fn a_good_state_is_sealed_already() {
    assert!(sealed(state()) == state());
}

#[test]
fn images_larger_than_their_file_are_refused() {
    let path = file();
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let window =
        image().windows(name.len()).position(|part| part == name).expect("a data window") + name.len();
    let mut bytes = image().to_vec();
    // The last column and the last row.
    bytes[window + 8..window + 12].copy_from_slice(&8_388_703_i32.to_le_bytes());
    bytes[window + 12..window + 16].copy_from_slice(&95_i32.to_le_bytes());
    std::fs::write(&path, bytes).expect("a writable folder");
    let expected = "more pixels than the file can hold";
    let error = upbp_core::read_exr(&path).expect_err("gigabytes");
    assert!(error.to_string().contains(expected), "{error}");
    let error = upbp_scene::light::EnvironmentImage::load(&path).expect_err("gigabytes");
    assert!(format!("{error:?}").contains(expected), "{error:?}");
    let _ = std::fs::remove_file(path);
}

#[test]
fn what_nests_deeply_is_refused() {
    for depth in [10, 100, 1000, 100_000] {
        let phase = "Blend([(1, ".repeat(depth) + "Isotropic" + &")])".repeat(depth);
        let text = SCENES[2].replace("Rayleigh", &phase);
        let nested = SceneDescription::from_ron(&text);
        assert!(depth < 1000 || nested.is_err(), "{depth}");
        assert!(Settings::from_ron(&"(".repeat(depth)).is_err(), "{depth}");
        assert!(SceneDescription::from_ron(&"[".repeat(depth)).is_err(), "{depth}");
    }
}
