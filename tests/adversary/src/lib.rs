//! Tests of Plumb with adversarial input, and the invariants that must hold.
//!
//! Four campaigns, each a function of a seed and a size:
//!
//! - [`board`]: a board under absurd configurations, commands at any moment, damaged frames, lost
//!   answers of the law, emergencies and restarts;
//! - [`frames`]: the frame decoder against a plain reference;
//! - [`laws`]: the control laws at the extremes of their input;
//! - [`travel`]: stops at the end of the travel, with new setpoints in every tick.
//!
//! The tests run each campaign for some seconds. The program `adversary` runs one campaign for any
//! number of seeds. The same seed gives the same run.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod board;
pub mod campaign;
pub mod frames;
pub mod generate;
pub mod laws;
pub mod random;
pub mod travel;
