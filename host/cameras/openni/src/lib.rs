//! Cameras and recordings through OpenNI2, for Plumb and without `unsafe` for who uses it.
//!
//! The library (Debian's libopenni2-0) is loaded when it is asked for, so that its absence is a
//! message and not a program that does not start. A [`Camera`] has a thread of its own that alone
//! talks to the library: whatever a driver, a cable or a damaged recording does,
//! [`Camera::next_pair`] comes back in bounded time.
//!
//! ```no_run
//! use plumb_openni::{Camera, OpenNi, Settings, Target};
//!
//! let openni = OpenNi::load()?;
//! let mut camera = Camera::open(&openni, &Target::First, Settings::default())?;
//! while let Some(pair) = camera.next_pair()? {
//!     println!("{:.3} s: {} bytes of colour, {} depths", pair.time, pair.colour.len(), pair.depth.len());
//! }
//! # Ok::<(), plumb_openni::OpenniError>(())
//! ```

mod api;
mod camera;
mod clock;
mod device;
mod error;
mod events;
mod handle;
mod library;
mod mailbox;
mod oni_file;
mod oni_node;
mod pairing;
mod picture;
mod recorder;
mod stream;
pub mod sys;
mod worker;

pub use camera::{Camera, Deadlines, Opened, Settings, Target};
pub use clock::HostClock;
pub use error::OpenniError;
pub use library::{DeviceInfo, LIBRARY_VARIABLE, OpenNi};
pub use pairing::{Pairing, Timed};
pub use picture::{DepthUnit, Mode, Pair, Sensor};
