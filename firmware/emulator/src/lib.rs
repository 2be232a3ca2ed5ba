//! An emulated board and simulated rigs.
//!
//! The emulated board runs the firmware's core ([`plumb_core`]) on a host, in virtual time or on a
//! pseudo-terminal. Its steps move a [plant]: a ball on three cables. A [`Harness`] runs the core
//! alone, without plant and link.

pub mod board;
pub mod harness;
pub mod plant;
pub mod serve;
pub mod tmc2209;
pub mod wire;

pub use board::{DriverTrouble, EMULATED, EmulatedBoard, MotorSample};
pub use harness::{Harness, LawDelay};
pub use serve::{BoardTime, Pace, Reply, Served, Terminal, serve, serve_at};
pub use wire::Wire;
