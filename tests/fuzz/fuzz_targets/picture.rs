//! The target `picture` for cargo-fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| plumb_fuzz::target::picture::run(input));
