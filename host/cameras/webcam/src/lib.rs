//! Webcams through V4L2, and video files through OpenCV's module `videoio`.
//!
//! - [`WebcamSettings`]: table `[camera.webcam]` of a rig file, which opens a webcam as a source of
//!   frames, [`WebcamSource`].
//! - [`Webcam`]: a camera with its size, rate and controls set and read back, and its pictures with
//!   time stamps on the host's clock.
//! - `VideoFile`, `VideoFileSource`: a video file, with its own time stamps; with the feature
//!   `videoio` only. No type of OpenCV is in the interface.
//!
//! Pictures have no depth.
//!
//! ```no_run
//! use std::time::Instant;
//!
//! use plumb_webcam::{Webcam, WebcamSettings};
//!
//! let mut webcam = Webcam::open(&WebcamSettings::default())?;
//! let start = Instant::now();
//! let (time, picture) = webcam.next_picture(|| start.elapsed().as_secs_f64())?;
//! println!("{} pixels, taken {time:.3} s after the start", picture.pixels().len());
//! # Ok::<(), plumb_webcam::WebcamError>(())
//! ```

#![deny(unsafe_code)]
#![deny(missing_docs)]

mod controls;
mod driver;
mod error;
mod kernel;
mod mode;
mod node;
mod nodes;
mod settings;
mod source;
#[cfg(feature = "videoio")]
mod video_file;
mod webcam;

pub use driver::{NotBuilt, VIDEO_ENDINGS};
pub use error::WebcamError;
pub use mode::Mode;
pub use settings::{PixelFormat, PowerLine, WebcamSettings};
pub use source::WebcamSource;
#[cfg(feature = "videoio")]
pub use video_file::{LibraryError, Picture, VideoFile, VideoFileError, VideoFileSource};
pub use webcam::Webcam;
