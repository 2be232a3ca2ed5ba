//! The target `http_reply` for cargo-fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| plumb_fuzz::target::http_reply::run(input));
