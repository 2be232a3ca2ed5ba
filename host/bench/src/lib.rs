//! Benchmarks of control and vision that anyone can repeat from a seed.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod control;
pub mod vision;
