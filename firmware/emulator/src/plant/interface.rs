//! Interface of the plant models, and their errors.

use nalgebra::Point3;
use plumb_protocol::{PerAxis, PerMotor};
use thiserror::Error;

/// Longest time step of [`Plant::advance`], seconds.
pub const LONGEST_STEP_S: f64 = 10.0;

/// Model of a rig whose ball follows the motors: [`QuasiStatic`](super::QuasiStatic) or
/// [`Elastic`](super::Elastic). The steps of an absent motor have no effect; it has no tension and
/// no slack.
pub trait Plant {
    /// Advances time by `dt_s` seconds (0 to [`LONGEST_STEP_S`]), during which the motors turn from
    /// their last positions to `motors` (full steps since the start, + pays out, fractions allowed;
    /// order A, B, C).
    ///
    /// # Errors
    /// If a number is not finite or out of range, a cable is reeled in completely, or rigid cables
    /// are too short to meet. The plant is then unchanged.
    fn advance(&mut self, dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError>;

    /// Places the motors at `motors` and lets the ball come to rest. The default is for a plant
    /// whose ball is always at rest.
    ///
    /// # Errors
    /// The errors of [`advance`](Self::advance).
    fn settle(&mut self, motors: PerMotor<f64>) -> Result<(), RigError> {
        self.advance(0.0, motors)
    }

    /// Lets each cable run off its drum, whose motor has no current, as far as a ball needs that
    /// sinks by this height (metres, 0 or more; order A, B, C). It counts from the next
    /// [`advance`](Self::advance) on. The default is for a plant whose motors always have current.
    fn run_off(&mut self, _heights_m: PerMotor<f64>) {}

    /// Winds in what has run off, as a person who hangs the ball again.
    fn hang_again(&mut self) {}

    /// Returns the ball's centre, metres in the rig frame.
    fn ball(&self) -> Point3<f64>;

    /// Returns which cables are slack; order A, B, C.
    fn slack(&self) -> PerMotor<bool>;

    /// Returns the tension of each cable over the ball's weight, >= 0; order A, B, C. `None` for a
    /// model without forces, which is the default.
    fn tensions_per_weight(&self) -> Option<PerMotor<f64>> {
        None
    }
}

/// Reason why a rig cannot be created or cannot follow its motors. Motors are named 'A', 'B', 'C'.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RigError {
    /// A setting or an argument is outside its range.
    #[error("{name} is {value}, but must be {allowed}")]
    OutOfRange {
        /// Name of the value, with its unit.
        name: &'static str,
        /// The value.
        value: f64,
        /// Description of the range.
        allowed: &'static str,
    },
    /// Seen from above, the motors lie on one line.
    #[error(
        "the motors are (nearly) on one line when seen from above (triangle of {area_m2:.1e} m²): \
         the three cables cannot hold the ball in space; check the motor positions"
    )]
    Flat {
        /// Area of the triangle of motors as projected on the horizontal plane, m².
        area_m2: f64,
    },
    /// Seen from above, two motors of a plane are at one point.
    #[error(
        "the two motors are (nearly) above one another (horizontally {apart_m:.1e} m apart): the \
         two cables cannot hold the ball in a plane; check the motor positions"
    )]
    AboveOneAnother {
        /// Horizontal distance of the motors, metres.
        apart_m: f64,
    },
    /// A motor has reeled its whole cable in.
    #[error(
        "motor {motor} has reeled its whole cable in ({length_m:.3} m are left): do not reel in \
         beyond the pulley"
    )]
    NoCable {
        /// The motor.
        motor: char,
        /// Cable length that would be left, metres (zero or less).
        length_m: f64,
    },
    /// Two rigid cables together are shorter than the distance between their motors.
    #[error(
        "cables {first} and {second} are {sum_m:.3} m together, but their motors are \
         {apart_m:.3} m apart: they cannot meet at the ball; pay one of them out"
    )]
    TooShort {
        /// One motor.
        first: char,
        /// The other motor.
        second: char,
        /// Both cable lengths together, metres.
        sum_m: f64,
        /// Distance between the motors, metres.
        apart_m: f64,
    },
    /// Each pair of rigid cables can meet, but the three have no common point.
    #[error(
        "cables of {:.3}, {:.3} and {:.3} m cannot all three reach one point: pay one of them out",
        .lengths_m[0], .lengths_m[1], .lengths_m[2]
    )]
    TooShortTogether {
        /// The cable lengths, metres; order A, B, C.
        lengths_m: PerMotor<f64>,
    },
    /// A ball cannot be at rest at the point: a cable would have to push.
    #[error(
        "the ball cannot hang at ({:.3}, {:.3}, {:.3}) m: cable {motor} would have to push; \
         choose a point below the motors and between them",
        .ball_m[0], .ball_m[1], .ball_m[2]
    )]
    CannotHang {
        /// The motor whose cable would push.
        motor: char,
        /// The point, metres in the rig frame.
        ball_m: PerAxis<f64>,
    },
}

/// Names of the motors in their order.
pub(crate) const NAMES: PerMotor<char> = ['A', 'B', 'C'];

/// Returns `value` if it is finite and `good` holds for it, otherwise [`RigError::OutOfRange`].
pub(crate) fn check(
    name: &'static str,
    value: f64,
    allowed: &'static str,
    good: impl Fn(f64) -> bool,
) -> Result<f64, RigError> {
    if value.is_finite() && good(value) {
        Ok(value)
    } else {
        Err(RigError::OutOfRange { name, value, allowed })
    }
}

/// Checks the arguments of [`super::Plant::advance`].
pub(crate) fn check_advance(dt_s: f64, motors: PerMotor<f64>) -> Result<(), RigError> {
    check("dt_s (time step, s)", dt_s, "between 0 and 10", |dt| {
        (0.0..=LONGEST_STEP_S).contains(&dt)
    })?;
    for steps in motors {
        check("motor position (full steps)", steps, "a finite number", |_| true)?;
    }
    Ok(())
}
