//! Webcams (V4L2) and video files through OpenCV's module `videoio`.
//!
//! - [`Webcam`]: a camera, set to a size and a rate that are read back, with time stamps on the
//!   host's clock.
//! - [`VideoFile`]: a video file, picture by picture, with its own time stamps.
//!
//! Pictures have no depth. No type of OpenCV is in the interface.
//!
//! ```no_run
//! use std::time::Instant;
//!
//! use plumb_webcam::{Settings, Webcam};
//!
//! let mut webcam = Webcam::open(&Settings::default())?;
//! let start = Instant::now();
//! let picture = webcam.next_picture(|| start.elapsed().as_secs_f64())?;
//! println!("{} pixels, taken {:.3} s after the start", picture.bgr.len(), picture.time);
//! # Ok::<(), plumb_webcam::WebcamError>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod error;
mod picture;
mod settings;
mod tracks;
mod video_file;
mod webcam;

pub use error::{LibraryError, WebcamError};
pub use picture::Picture;
pub use settings::{Mode, Settings, device_path};
pub use video_file::VideoFile;
pub use webcam::Webcam;
