//! A software device of librealsense2 that shows rendered pictures, for tests with the real
//! library.
//!
//! [`SoftwareCamera`] is plugged into the library's context beside the cameras at the USB. Its
//! pictures are those of `plumb-openni-driver`: a ball in front of a wall. Like a D435 its depth
//! sensor is beside its colour sensor, so that depth without alignment is 20 pixels off.

mod api;
mod camera;
mod fault;
mod feeder;
mod installed;
mod pixels;

pub use api::project;
pub use camera::{BASELINE, Model, SoftwareCamera, Stamp, UNIT};
pub use fault::Fault;
pub use feeder::Feeder;
pub use installed::{installed, library};
pub use plumb_openni_driver::{Control, FOCAL_LENGTH};
