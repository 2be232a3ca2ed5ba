//! Sources of RGB-D frames: cameras and recordings.

mod camera_source;
mod error;
pub mod openni;
pub mod playback;
mod recording;
pub mod tum;

pub use camera_source::CameraSource;
pub use error::{BoxedError, InvalidFrame, SourceError};
pub use recording::{OpenRecordingError, OpenedRecording, open_recording};
