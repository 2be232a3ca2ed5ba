//! A camera of another node, such as realsense-ros.

mod driver;
mod error;
pub(crate) mod intake;
pub(crate) mod lens;
mod pairs;
pub(crate) mod picture;
mod rate;
mod reception;
mod source;

pub use driver::Ros2Driver;
pub use error::Ros2CameraError;
pub use source::{FIRST_PICTURE, Ros2Camera};
