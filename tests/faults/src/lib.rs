//! The fault campaign: closed loops with faults of the link, the camera, the rig, the host and the
//! power, and the invariants that must hold in every tick of every run.
//!
//! ```text
//! seed -> Plan (faults, law, targets) -> World: host <-> link <-> board -> rig -> camera -> host
//!                                          | every tick: invariants, distances
//!                                          +-> Report -> table
//! ```
//!
//! The host is the real control loop, the board is the emulated one, and time is virtual: the same
//! seed gives the same run. The program `faults` (`make faults`) runs the campaign and draws the
//! table.

#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

pub mod cause;
mod host;
pub mod kind;
pub mod page;
pub mod plan;
pub mod report;
pub mod run;
pub mod table;
pub mod world;
