//! MCAP recordings of a camera: messages of ROS 2, or of Foxglove.
//!
//! ```text
//! file -> reader (records) -> topics (those of the camera) -> decode -> frames (pairs) -> source
//! ```

mod chunk;
mod decode;
mod error;
mod foxglove;
mod reader;
mod source;
#[cfg(test)]
mod tests;
mod topics;

pub use error::McapError;
pub use source::McapRecording;
