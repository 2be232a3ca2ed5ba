//! The target `oni_file` for cargo-fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| plumb_fuzz::target::oni_file::run(input));
