//! The rig as a plant: a ball on three cables, three motors, a camera that is late and noisy.
//!
//! SI and `f64` throughout, in the rig frame of the control notes: z up, y from B to A, C on the
//! side of smaller x. Motor positions are full steps since the start, + pays cable out, fractions
//! (microsteps) allowed.
//!
//! - [`Geometry`]: where the motors are and how much cable a step is.
//! - [`Plant`]: what a rig does when its motors move. [`QuasiStatic`]: the ball is always at rest;
//!   [`Elastic`]: it has mass and hangs on springs that cannot push.
//! - [`Observer`]: what a camera would report of the ball, for loops that need no pictures.
//! - [`Task`], [`Population`]: the paper's task and random ones.

mod elastic;
mod error;
mod forward;
mod geometry;
mod observer;
mod population;
mod quasi_static;

pub use elastic::{Elastic, ElasticParameters, GRAVITY_M_S2};
pub use error::RigError;
pub use forward::{Hang, lowest_point};
pub use geometry::{FULL_STEPS_PER_REVOLUTION, Geometry};
pub use observer::{DepthDrift, Observation, Observer, ObserverParameters};
pub use population::{Population, Task, Variations};
pub use quasi_static::QuasiStatic;

use nalgebra::Point3;

/// A rig that time and its motors act on: [`QuasiStatic`] or [`Elastic`], interchangeable.
pub trait Plant {
    /// Lets `dt_s` seconds (0 to 10) pass, during which the motors go from where they were to
    /// `motors` (full steps since the start, + pays out, fractions allowed; order A, B, C).
    ///
    /// # Errors
    /// A number that is not finite or out of range, a cable reeled in to nothing, or (rigid cables)
    /// cables too short to meet. The plant is then where it was before the call.
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError>;

    /// The ball's centre, metres in the rig frame.
    fn ball(&self) -> Point3<f64>;

    /// Which cables bear nothing now; order A, B, C.
    fn slack(&self) -> [bool; 3];
}
