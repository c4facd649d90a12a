//! Text as a scene file: refused, or built and rendered a little.

#![no_main]

use upbp_testing::readers;

libfuzzer_sys::fuzz_target!(|text: &str| readers::read_scene(text));
