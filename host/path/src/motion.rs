//! Motions: waypoints, limits, moments and samples, and the errors about them.

use nalgebra::{Point3, Vector3};
use thiserror::Error;

/// Motion of the ball at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Place, metres.
    pub position: Point3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Acceleration, m/s².
    pub acceleration: Vector3<f64>,
}

impl Moment {
    /// Returns the motion of a ball that rests at `position`.
    #[must_use]
    pub fn resting(position: Point3<f64>) -> Self {
        Self { position, velocity: Vector3::zeros(), acceleration: Vector3::zeros() }
    }
}

/// Limits of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Largest speed, m/s.
    pub speed: f64,
    /// Largest acceleration, m/s².
    pub acceleration: f64,
    /// Largest jerk, m/s³.
    pub jerk: f64,
}

/// Acceleration of [`MotionLimits::with_speed`], m/s²: a quarter of what the paper's motors can do.
pub const DEFAULT_ACCELERATION: f64 = 0.25;
/// Jerk of [`MotionLimits::with_speed`], m/s³. The cubic Hermite polynomial between two moments
/// 0.1 s apart is then within 0.1 mm of the trajectory.
pub const DEFAULT_JERK: f64 = 5.0;

impl MotionLimits {
    /// Returns limits with this speed, m/s, and the default acceleration and jerk.
    pub fn with_speed(speed: f64) -> Self {
        Self { speed, acceleration: DEFAULT_ACCELERATION, jerk: DEFAULT_JERK }
    }

    /// Checks that every limit is within [`LIMITS`].
    pub(crate) fn check(&self) -> Result<(), PathError> {
        let named =
            [("speed", self.speed), ("acceleration", self.acceleration), ("jerk", self.jerk)];
        match named.into_iter().find(|(_, value)| !LIMITS.contains(value)) {
            Some((name, value)) => Err(PathError::Limit { name, value }),
            None => Ok(()),
        }
    }
}

/// Range of the limits in SI units. What is beyond it is no motion of a ball.
pub(crate) const LIMITS: std::ops::RangeInclusive<f64> = 1e-9..=1e6;

/// Largest coordinate of a place, and largest tolerance, metres. Millimetres are beyond it.
pub const MAX_COORDINATE_M: f64 = 100.0;

/// Repetition of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Run {
    /// From rest at the start to rest at the end.
    Once,
    /// From rest at the start, and then round and round without an end.
    Loop,
}

/// Waypoints of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Waypoints {
    /// Places in their order, metres.
    pub places: Vec<Point3<f64>>,
    /// Largest speed from each place to the next one, m/s, beside that of the whole path. Where
    /// there are fewer, or one is infinite, there is none of its own.
    pub speeds: Vec<f64>,
    /// Largest distance of the path from a waypoint, metres. At 0 the ball stops at each corner.
    pub tolerance: f64,
}

/// Place with a time stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time, seconds.
    pub time: f64,
    /// Place, metres.
    pub position: Point3<f64>,
}

/// Least distance of two waypoints, metres: the board's unit.
pub(crate) const LEAST_DISTANCE_M: f64 = 1e-6;

/// Least size of a shape, metres.
pub const LEAST_SIZE_M: f64 = 0.001;

/// Largest size of a shape, metres: the width of the largest workspace.
pub const MAX_SIZE_M: f64 = 8.0;

/// Mistake in a path.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PathError {
    /// There are too few places.
    #[error("the path needs {least} places or more, but has {count}")]
    TooFew {
        /// Number of places.
        count: usize,
        /// Least number.
        least: usize,
    },
    /// There are too few places for a loop with time stamps.
    #[error(
        "a loop with times needs {least} places or more, of which the last one is the first again, \
         but has {count}: add places of the way back to the first one, with their times"
    )]
    TooFewInLoop {
        /// Number of places.
        count: usize,
        /// Least number.
        least: usize,
    },
    /// A time stamp is not above the one before.
    #[error("the time of sample {number} is not above the one before")]
    TimeNotRising {
        /// Number of the sample, from 1.
        number: usize,
    },
    /// A loop with time stamps does not end where it begins.
    #[error(
        "the last place of a loop must be the first one, but is {gap_mm:.3} mm away from it: add \
         the first one again at the end, with its time"
    )]
    OpenLoop {
        /// Distance, millimetres.
        gap_mm: f64,
    },
    /// A time is not finite.
    #[error("a time is not a finite number")]
    NotFinite,
    /// A coordinate or the tolerance is out of its range.
    #[error("{name} is {value:?} m, but must be within {MAX_COORDINATE_M} m: is it in metres?")]
    Far {
        /// Name of the length.
        name: &'static str,
        /// Its value, metres.
        value: f64,
    },
    /// The size of a shape is out of its range.
    #[error("the size of a shape is {0:?} m, but must be {LEAST_SIZE_M} to {MAX_SIZE_M} m")]
    Size(f64),
    /// The ball would be under way for too long.
    #[error(
        "the path takes {hours:.1} hours, but 24 are the most: are its times in seconds, its \
         places in metres, and is its speed right?"
    )]
    TooLong {
        /// Time, hours; of a loop that of the first lap.
        hours: f64,
    },
    /// A limit is out of its range.
    #[error("the limit of {name} is {value:?}, but must be above 0, from 1e-9 to 1e6 in SI units")]
    Limit {
        /// Name of the limit.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Checks that all coordinates are within [`MAX_COORDINATE_M`].
pub(crate) fn check_near<'a>(
    places: impl IntoIterator<Item = &'a Point3<f64>>,
) -> Result<(), PathError> {
    let mut coordinates = places.into_iter().flat_map(|place| place.iter());
    match coordinates.find(|it| it.is_nan() || it.abs() > MAX_COORDINATE_M) {
        Some(&value) => Err(PathError::Far { name: "a coordinate", value }),
        None => Ok(()),
    }
}
