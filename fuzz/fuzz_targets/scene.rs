//! Text as a scene file: refused or built.

#![no_main]

libfuzzer_sys::fuzz_target!(|text: &str| {
    let _ = upbp_scene::ReadyScene::from_ron_str(text, "no/such/folder");
});
