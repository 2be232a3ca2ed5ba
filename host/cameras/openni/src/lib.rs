//! Cameras and recordings through OpenNI2, behind an interface without `unsafe`.
//!
//! [`OpenniSettings`] is the table `[camera.openni]` of a rig file, which opens a camera as a
//! source of frames ([`open_source`]).
//!
//! The library (Debian's package libopenni2-0) is loaded at run time, so that a program also starts
//! without it. A [`Camera`] has a thread of its own, which makes all calls into the library:
//! [`Camera::next_pair`] returns in bounded time, also where a driver, a cable or a damaged
//! recording blocks a call.
//!
//! ```no_run
//! use plumb_openni::{Camera, OpenNi, Settings, Target};
//!
//! let openni = OpenNi::load()?;
//! let mut camera = Camera::open(&openni, &Target::First, Settings::default())?;
//! while let Some(pair) = camera.next_pair()? {
//!     println!("{:.3} s: {} depths", pair.time, pair.depth.len());
//! }
//! # Ok::<(), plumb_openni::OpenniError>(())
//! ```

mod api;
mod camera;
mod device;
mod driver;
mod error;
mod events;
#[doc(hidden)]
pub mod fuzzing;
mod handle;
mod library;
mod oni_file;
mod picture;
mod reader;
mod recorder;
mod settings;
mod source;
mod stream;
pub mod sys;
mod threads;

pub use camera::Camera;
pub use driver::OpenniSettings;
pub use error::OpenniError;
pub use library::{DeviceInfo, OpenNi};
pub use oni_file::{check_recording, is_recording};
pub use plumb_frame::pairing::Sensor;
pub use plumb_pictures::pair::Pair;
pub use settings::{DepthUnit, Mode, Opened, Settings, Target, Timeouts};
pub use source::{IntrinsicsSource, OpenniSourceError, open_source};
pub use sys::LIBRARY_VARIABLE;
