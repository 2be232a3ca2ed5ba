//! A camera that is not there, as a driver for OpenNI2, so that tests go through the real library.
//!
//! It renders a ball before a wall and does as a [`Control`] says, which tests write to a file that
//! the driver reads before every picture: where the ball is, whether it is plugged in, what it does
//! wrongly. Like a PrimeSense camera it begins at 320x240, mirrored, with depth as the depth sensor
//! sees it: who does not set it up sees the difference.
//!
//! Its URI is `plumb-test:PATH` with the path of the control file. Where [`CONTROL_VARIABLE`] holds
//! such a path, that camera is plugged in from the beginning.

pub mod control;
mod device;
mod exports;
mod render;
pub mod stage;

pub use control::{Control, ControlFile};
pub use render::{FOCAL_LENGTH, INTRINSICS_CENTRE};
pub use stage::stage;

/// What the URIs of these cameras begin with.
pub const SCHEME: &str = "plumb-test:";

/// The environment variable with the control file of a camera that is plugged in from the
/// beginning.
pub const CONTROL_VARIABLE: &str = "PLUMB_TEST_CAMERA";
