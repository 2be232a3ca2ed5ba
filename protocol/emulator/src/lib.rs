//! An emulated board and simulated rigs.
//!
//! The emulated board runs the firmware's core ([`plumb_core`]) on a host, in virtual time or on a
//! pseudo-terminal. Its steps move a [plant]: a ball on three cables.

pub mod board;
pub mod harness;
pub mod plant;
mod sampler;
pub mod serve;
pub mod terminal;
pub mod wire;

pub use board::{EMULATED, EmulatedBoard};
pub use harness::{Harness, LawDelay};
pub use sampler::MotorSample;
pub use serve::{Served, serve};
pub use terminal::Terminal;
pub use wire::Wire;
