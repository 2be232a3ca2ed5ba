//! Intel RealSense cameras and their recordings, behind an interface without `unsafe`.
//!
//! [`RealsenseSettings`] is the table `[camera.realsense]` of a rig file, which opens a camera as a
//! source of frames ([`open_source`]).
//!
//! librealsense2 is loaded at run time, so that a program also starts without it. Intel's packages
//! and the Python wheel `pyrealsense2` contain it. A [`Camera`] reads both sensors without the
//! library's own pairing, which goes by arrival: it pairs pictures by their time stamps and lets
//! the library align depth to colour.
//!
//! ```no_run
//! use plumb_realsense::{Camera, RealSense, Settings, Target};
//!
//! let library = RealSense::load()?;
//! let mut camera = Camera::open(&library, &Target::First, Settings::default())?;
//! while let Some(pair) = camera.next_pair()? {
//!     println!("{:.3} s: {} depths", pair.time, pair.depth.len());
//! }
//! # Ok::<(), plumb_realsense::RealsenseError>(())
//! ```

#![deny(missing_docs)]

mod aligner;
mod api;
mod camera;
mod device;
mod driver;
mod error;
mod handle;
mod library;
mod options;
mod sensor;
mod settings;
mod source;
pub mod sys;

pub use camera::Camera;
pub use driver::RealsenseSettings;
pub use error::RealsenseError;
pub use library::{DeviceInfo, RealSense};
pub use plumb_frame::pairing::Sensor;
pub use plumb_pictures::pair::Pair;
pub use settings::{DistortionModel, Intrinsics, Mode, Opened, Settings, Target};
pub use source::{RealsenseSourceError, open_source};
pub use sys::LIBRARY_VARIABLE;
