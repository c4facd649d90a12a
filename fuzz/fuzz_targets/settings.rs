//! Text as a settings file: refused or checked.

#![no_main]

use upbp_testing::readers;

libfuzzer_sys::fuzz_target!(|text: &str| readers::read_settings(text));
