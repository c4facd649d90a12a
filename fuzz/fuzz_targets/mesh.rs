//! Text as an OBJ file: refused, or made a shape.

#![no_main]

#[path = "../../tests/it/support/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|text: &str| readers::read_mesh(text));
