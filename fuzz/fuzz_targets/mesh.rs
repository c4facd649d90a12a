//! Text as an OBJ file.

#![no_main]

libfuzzer_sys::fuzz_target!(|text: &str| {
    let _ = upbp_scene::obj::ObjMesh::parse(text);
});
