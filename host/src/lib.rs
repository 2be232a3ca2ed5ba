//! Plumb without hardware: simulated rigs and synthetic pictures of them, and the benchmarks.

pub mod bench;
pub mod cosim;
pub mod memory;
pub mod source;
