//! A simulated camera as a driver for OpenNI2, for tests with the real library.
//!
//! It renders a ball in front of a wall. Tests write a [`Control`] to a file, which the driver
//! reads before every frame: the position of the ball, whether the camera is plugged in, and its
//! faults. Like a PrimeSense camera it starts at 320x240, mirrored, with unregistered depth, so
//! that a missing setup has an effect.
//!
//! Its URI is `plumb-test:PATH` with the path of the control file. If [`CONTROL_VARIABLE`] has such
//! a path, that camera is plugged in from the start.

pub mod control;
mod device;
mod exports;
pub mod render;
pub mod stage;

pub use control::{Control, ControlFile};
pub use render::{FOCAL_LENGTH, INTRINSICS_CENTRE};
pub use stage::stage;

/// Scheme of the cameras' URIs.
pub const SCHEME: &str = "plumb-test:";

/// Environment variable with the control file of a camera that is plugged in from the start.
pub const CONTROL_VARIABLE: &str = "PLUMB_TEST_CAMERA";
