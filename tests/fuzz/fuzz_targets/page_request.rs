//! The target `page_request` for cargo-fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| plumb_fuzz::target::page_request::run(input));
