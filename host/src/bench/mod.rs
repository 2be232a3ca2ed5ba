//! Comparisons that can be repeated from a seed.

pub mod vision;
