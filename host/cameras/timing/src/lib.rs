//! Time stamps of RGB-D cameras, for the crates of the cameras' libraries.
//!
//! - [`HostClock`]: mapping of a device's time stamps to the host's clock; [`SensorClocks`]: the
//!   mappings of a camera's two sensors.
//! - [`SenderClock`]: the same for a program that sends pictures and may state their age.
//! - [`Pairing`]: pairs of colour and depth pictures by their time stamps.
//!
//! ```
//! use plumb_timing::{Paired, Pairing, Sensor, Timed};
//!
//! #[derive(Debug, PartialEq)]
//! struct Stamp(f64);
//!
//! impl Timed for Stamp {
//!     fn time(&self) -> f64 {
//!         self.0
//!     }
//! }
//!
//! let mut pairing = Pairing::new(0.013);
//! pairing.add(Sensor::Depth, Stamp(1.000));
//! assert_eq!(pairing.take(), None);
//! pairing.add(Sensor::Colour, Stamp(1.002));
//! assert_eq!(pairing.take(), Some(Paired::Pair(Stamp(1.002), Stamp(1.000))));
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod clock;
mod pairing;
mod sender;
mod sensor;

pub use clock::{HostClock, SensorClocks};
pub use pairing::{Paired, Pairing, Taken, Timed};
pub use sender::{SenderClock, SenderClockError};
pub use sensor::Sensor;
