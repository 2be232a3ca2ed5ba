//! The target `tum_folder` for cargo-fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| plumb_fuzz::target::tum_folder::run(input));
