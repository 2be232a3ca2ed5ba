//! Sources of RGB-D frames: cameras and recordings.

mod camera_source;
pub mod capture;
mod clock;
mod error;
pub mod openni;
pub mod playback;
pub mod realsense;
mod recording;
pub mod resolution;
pub mod ros2;
pub mod stream;
pub mod tum;
pub mod webcam;

pub use camera_source::CameraSource;
pub use clock::LiveClock;
pub use error::{BoxedError, InvalidFrame, SourceError};
pub use recording::{OpenRecordingError, OpenedRecording, is_mcap, open_recording};
pub use resolution::UnfitIntrinsics;
