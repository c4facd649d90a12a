//! Text as a settings file: refused or checked.

#![no_main]

#[path = "../../tests/it/support/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|text: &str| readers::read_settings(text));
