//! Plumb without hardware: an emulated board that moves a simulated rig, a camera that renders it,
//! and co-simulation with other physics engines.
//!
//! - [`simulated`]: a simulated rig, in virtual or real time, as a camera source.
//! - [`synthetic`]: the renderer: ball, cables, room, and what an RGB-D sensor adds.
//! - [`memory`]: a link to an emulated board without a serial port.
//! - [`cosim`]: the board in lock step with another physics engine.
//! - [`limits`]: a board configuration with wide limits.
//!
//! [`plumb_emulator`] is part of this crate's interface and exported as [`emulator`].

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod cosim;
pub mod limits;
pub mod memory;
pub mod simulated;
pub mod synthetic;

pub use plumb_emulator as emulator;
