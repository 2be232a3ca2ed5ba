//! Comparisons that can be repeated from a seed.

pub mod control;
pub mod vision;
