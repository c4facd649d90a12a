//! Text as an OBJ file: refused, or made a shape.

#![no_main]

use upbp_testing::readers;

libfuzzer_sys::fuzz_target!(|text: &str| readers::read_mesh(text));
