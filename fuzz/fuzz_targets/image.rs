//! Bytes as an OpenEXR file, as an environment and as a reference.

#![no_main]

use upbp_testing::readers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = std::env::temp_dir().join(format!("upbp_fuzz_{}.exr", std::process::id()));
    readers::read_image(bytes, &path);
});
