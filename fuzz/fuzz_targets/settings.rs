//! Text as a settings file: refused or checked.

#![no_main]

libfuzzer_sys::fuzz_target!(|text: &str| {
    let _ = upbp_core::Settings::from_ron(text).map(upbp_core::Settings::validate);
});
