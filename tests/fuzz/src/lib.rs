//! Fuzz targets: functions that take any bytes and must not panic, overflow or hang.
//!
//! Each [`target`] is a function of an input. Two programs call it: `fuzz` of this crate, which
//! changes the inputs of the corpus with a seeded [`generator`] on any compiler, and cargo-fuzz
//! with libFuzzer on a nightly compiler, which looks for inputs that reach new code.
//!
//! tests/fuzz/README.md tells how to run both.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod campaign;
pub mod corpus;
mod fuzz_target;
pub mod generator;
#[cfg(feature = "host")]
mod recording;
pub mod target;
