//! Everything that reads files, and what becomes of a file that is accepted: an error or a result, never a
//! panic. For `tests/it/hostile/parsers.rs` and the targets in `fuzz/`.

use std::path::Path;

use upbp_core::{LightPaths, Settings, State, StateError};
use upbp_scene::obj::{ObjFile, PartError};
use upbp_scene::{ReadyScene, SceneDescription};

/// Settings for a little of a render.
pub fn little() -> Settings {
    Settings {
        techniques: "all".parse().expect("technique names"),
        light_paths: LightPaths::Count(8),
        max_length: 6,
        ..Settings::default()
    }
}

/// Reads a scene; one that is accepted is written, read again, and a little of it rendered.
pub fn read_scene(text: &str) {
    let Ok(mut description) = SceneDescription::from_ron(text) else { return };
    let written = description.to_ron().expect("what was read can be written");
    assert_eq!(SceneDescription::from_ron(&written).expect("what was written can be read"), description);
    description.film = upbp_scene::description::Film {
        width: upbp_scene::description::Count::new(3).expect("a size"),
        height: upbp_scene::description::Count::new(2).expect("a size"),
        crop: None,
    };
    let Ok(scene) = ReadyScene::build(&description, "no/such/folder") else { return };
    if let Ok(mut renderer) = scene.renderer(little().validate().expect("valid settings")) {
        renderer.iterate();
        let fine = |value: &f32| value.is_finite() && *value >= 0.0;
        assert!(renderer.film().image().pixels.iter().flatten().all(fine), "{text}");
    }
}

/// Reads settings; those that are accepted are checked.
pub fn read_settings(text: &str) {
    if let Ok(settings) = Settings::from_ron(text) {
        let _ = settings.validate();
    }
}

/// Reads a mesh; one that is accepted becomes a shape.
pub fn read_mesh(text: &str) {
    if let Ok(file) = ObjFile::parse(text) {
        let parts: Vec<_> = file.parts().collect();
        assert!(parts.iter().all(|part| file.part(part) != Err(PartError::Unknown)), "{parts:?}");
        let mesh = file.mesh();
        let _ = upbp_accel::TriangleMesh::new(mesh.positions, mesh.indices, mesh.normals);
    }
}

/// Reads an image, by way of a file.
pub fn read_image(bytes: &[u8], path: &Path) {
    std::fs::write(path, bytes).expect("a writable folder");
    let _ = upbp_scene::light::EnvironmentImage::load(path);
    let _ = upbp_core::read_exr(path);
    let _ = std::fs::remove_file(path);
}

/// Reads a state; one that is accepted is looked at, written, read again, and merged.
pub fn read_state(bytes: &[u8]) {
    let Ok(mut state) = State::read(bytes) else { return };
    let film = state.film();
    let _ = (film.image(), film.variance(), film.estimated_error(), film.shares(), film.fingerprint());
    let _ = (state.report().to_string(), serde_json::to_string(&state.report()));
    let mut written = Vec::new();
    state.write(&mut written).expect("a vector takes all");
    let again = State::read(written.as_slice()).expect("what was written can be read");
    let mut twice = Vec::new();
    again.write(&mut twice).expect("a vector takes all");
    assert!(twice == written, "reading and writing gives the same bytes");
    if !film.iteration_set().is_empty() {
        let error = state.merge(again).expect_err("iterations would count twice");
        assert!(matches!(error, StateError::Overlap { .. }), "{error}");
    }
    // The same with another iteration.
    let other = replace_between(&written, b"iterations:[", b"]", b"(268435455,268435456)");
    if let Ok(other) = State::read(sealed(&other).as_slice()) {
        let _ = state.merge(other);
        let _ = (state.film().image(), state.report().to_string());
    }
}

/// Replaces the bytes between the first `start` and the next `end`.
fn replace_between(bytes: &[u8], start: &[u8], end: &[u8], new: &[u8]) -> Vec<u8> {
    let find = |part: &[u8], from: usize| {
        bytes[from..].windows(part.len()).position(|window| window == part).map(|at| from + at)
    };
    let place = find(start, 0).map(|at| at + start.len());
    match place.and_then(|from| Some((from, find(end, from)?))) {
        Some((from, to)) => [&bytes[..from], new, &bytes[to..]].concat(),
        None => bytes.to_vec(),
    }
}

/// A changed state file with a good beginning, lengths and checksums: else nothing behind them would ever be
/// reached.
pub fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = b"UPBPSTAT\x09\0\0\0".to_vec();
    let mut checksum = 0xcbf2_9ce4_8422_2325_u64;
    let mut rest = bytes.get(12..).unwrap_or_default();
    while let Some((length, tail)) = rest.split_first_chunk() {
        // The header ends where its parentheses close; changes may have made it longer or shorter.
        let header = sealed.len() == 12;
        let length = if header { closed(tail) } else { u32::from_le_bytes(*length) as usize };
        let (block, tail) = tail.split_at(length.min(tail.len()));
        sealed.extend((block.len() as u32).to_le_bytes());
        sealed.extend(block);
        let padded = [block, &[0; 8][block.len() % 8..]].concat();
        let words = padded.chunks(8).map(|word| u64::from_le_bytes(word.try_into().expect("eight bytes")));
        for word in words.chain([block.len() as u64]) {
            checksum = (checksum ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            checksum ^= checksum >> 32;
        }
        sealed.extend(checksum.to_le_bytes());
        rest = tail.get(8..).unwrap_or_default();
    }
    sealed
}

/// Bytes until as many parentheses are closed as were opened.
fn closed(bytes: &[u8]) -> usize {
    let mut open = 0_usize;
    let end = bytes.iter().position(|byte| {
        match byte {
            b'(' => open += 1,
            b')' => open = open.saturating_sub(1),
            _ => {}
        }
        *byte == b')' && open == 0
    });
    end.map_or(bytes.len(), |end| end + 1)
}
