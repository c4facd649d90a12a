//! Text as a scene file: refused, or built and rendered a little.

#![no_main]

#[path = "../../tests/it/support/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|text: &str| readers::read_scene(text));
