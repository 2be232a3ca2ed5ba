//! Webcams (V4L2) and video files through OpenCV's module `videoio`.
//!
//! Without the feature `videoio` there are only the settings: a rig file with a webcam can be read,
//! and the webcams that are plugged in can be listed.
//!
//! - [`WebcamSettings`]: table `[camera.webcam]` of a rig file, which opens a webcam as a source of
//!   frames; `VideoFileSource`: a video file as a source of frames.
//! - `Webcam`: a camera, set to a size and a rate that are read back, with time stamps on the
//!   host's clock.
//! - `VideoFile`: a video file, picture by picture, with its own time stamps.
//!
//! Pictures have no depth. No type of OpenCV is in the interface.
//!
//! ```no_run
//! # #[cfg(feature = "videoio")] {
//! use std::time::Instant;
//!
//! use plumb_webcam::{Settings, Webcam};
//!
//! let mut webcam = Webcam::open(&Settings::default())?;
//! let start = Instant::now();
//! let picture = webcam.next_picture(|| start.elapsed().as_secs_f64())?;
//! println!("{} pixels, taken {:.3} s after the start", picture.bgr.len(), picture.time);
//! # }
//! # #[cfg(feature = "videoio")]
//! # Ok::<(), plumb_webcam::WebcamError>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod driver;
#[cfg(feature = "videoio")]
mod error;
#[cfg(feature = "videoio")]
mod picture;
#[cfg(feature = "videoio")]
mod settings;
#[cfg(feature = "videoio")]
mod source;
#[cfg(feature = "videoio")]
mod tracks;
#[cfg(feature = "videoio")]
mod video_file;
#[cfg(feature = "videoio")]
mod webcam;

pub use driver::{NotBuilt, PixelFormat, PixelFormatError, VIDEO_ENDINGS, WebcamSettings};
#[cfg(feature = "videoio")]
pub use error::{LibraryError, WebcamError};
#[cfg(feature = "videoio")]
pub use picture::Picture;
#[cfg(feature = "videoio")]
pub use settings::{Mode, Settings, device_path};
#[cfg(feature = "videoio")]
pub use source::{VideoFileSource, WebcamSource, WebcamSourceError};
#[cfg(feature = "videoio")]
pub use video_file::VideoFile;
#[cfg(feature = "videoio")]
pub use webcam::Webcam;
