//! Bytes as an OpenEXR file, as an environment and as a reference.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = std::env::temp_dir().join(format!("upbp_fuzz_{}.exr", std::process::id()));
    if std::fs::write(&path, bytes).is_ok() {
        let _ = upbp_scene::light::EnvironmentImage::load(&path);
        let _ = upbp_core::read_exr(&path);
    }
});
