//! Interface of the plant models.

use nalgebra::Point3;

use super::error::RigError;

/// Model of a rig whose ball follows the motors: [`QuasiStatic`](super::QuasiStatic) or
/// [`Elastic`](super::Elastic).
pub trait Plant {
    /// Advances time by `dt_s` seconds (0 to 10), during which the motors turn from their last
    /// positions to `motors` (full steps since the start, + pays out, fractions allowed; order A,
    /// B, C).
    ///
    /// # Errors
    /// If a number is not finite or out of range, a cable is reeled in completely, or rigid cables
    /// are too short to meet. The plant is then unchanged.
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError>;

    /// Places the motors at `motors` and lets the ball come to rest. The default is for a plant
    /// whose ball is always at rest.
    ///
    /// # Errors
    /// The errors of [`advance`](Self::advance).
    fn settle(&mut self, motors: [f64; 3]) -> Result<(), RigError> {
        self.advance(0.0, motors)
    }

    /// Returns the ball's centre, metres in the rig frame.
    fn ball(&self) -> Point3<f64>;

    /// Returns which cables are slack; order A, B, C.
    fn slack(&self) -> [bool; 3];

    /// Returns the tension of each cable over the ball's weight, >= 0; order A, B, C. `None` for a
    /// model without forces, which is the default.
    fn tensions_per_weight(&self) -> Option<[f64; 3]> {
        None
    }
}
