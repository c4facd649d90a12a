//! Bytes as a state file, as they are and with the lengths and checksums that they should have.

#![no_main]

use upbp_testing::readers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    readers::read_state(bytes);
    readers::read_state(&readers::sealed(bytes));
});
