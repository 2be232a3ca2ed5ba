//! The first evening of a rig.
//!
//! - [`new_rig`]: the rig file and the camera file of a new rig.
//! - [`commission`]: what is wrong with the wiring or the camera's pose, from small jogs.
//! - [`two_jogs`]: Jacobian and latency of two motors' ball in the picture of any camera.
//! - [`watch`]: the board and the camera while motors are jogged.
//! - [`selftest`]: the pulses, the flash and the clock of a board's chip, without a rig.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod commission;
pub mod new_rig;
pub mod selftest;
pub mod two_jogs;
pub mod watch;
