//! Trajectories: place, velocity and acceleration over time.

use nalgebra::{Point3, Vector3};
use thiserror::Error;

use crate::corner::blend;
use crate::curve::Curve;
use crate::profile::Profile;
use crate::shape::{LEAST_SIZE_M, MAX_SIZE_M};
use crate::time_law::TimeLaw;
use crate::timed::Timed;

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
pub struct Limits {
    /// Largest speed, m/s.
    pub speed: f64,
    /// Largest acceleration, m/s².
    pub acceleration: f64,
    /// Largest jerk, m/s³.
    pub jerk: f64,
}

/// Acceleration of [`Limits::with_speed`], m/s²: a quarter of what the paper's motors can do.
pub const DEFAULT_ACCELERATION: f64 = 0.25;
/// Jerk of [`Limits::with_speed`], m/s³. The cubic Hermite polynomial between two moments 0.1 s
/// apart is then within 0.1 mm of the trajectory.
pub const DEFAULT_JERK: f64 = 5.0;

impl Limits {
    /// Returns limits with this speed, m/s, and the default acceleration and jerk.
    pub fn with_speed(speed: f64) -> Self {
        Self { speed, acceleration: DEFAULT_ACCELERATION, jerk: DEFAULT_JERK }
    }

    /// Checks that every limit is within [`LIMITS`].
    fn check(&self) -> Result<(), PathError> {
        let named =
            [("speed", self.speed), ("acceleration", self.acceleration), ("jerk", self.jerk)];
        match named.into_iter().find(|(_, value)| !LIMITS.contains(value)) {
            Some((name, value)) => Err(PathError::Limit { name, value }),
            None => Ok(()),
        }
    }
}

/// Longest trajectory, seconds; of a loop its first lap.
const LONGEST_S: f64 = 24.0 * 3600.0;

/// Range of the limits in SI units. What is beyond it is no motion of a ball.
const LIMITS: std::ops::RangeInclusive<f64> = 1e-9..=1e6;

/// Largest coordinate of a place, and largest tolerance, metres. Millimetres are beyond it.
pub const MAX_COORDINATE_M: f64 = 100.0;

/// Repetition of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Run {
    /// From rest at the begin to rest at the end.
    Once,
    /// From rest at the begin, and then round and round without an end.
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

/// Trajectory of the ball. Position, velocity and acceleration are continuous.
#[derive(Debug, Clone)]
pub struct Trajectory {
    kind: Kind,
}

/// Kinds of trajectories.
#[derive(Debug, Clone)]
enum Kind {
    /// Along a curve, as fast as the limits allow.
    Curve(Curve, TimeLaw),
    /// With time stamps.
    Timed(Timed),
}

/// Mistake in a path.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PathError {
    /// There are too few places.
    #[error("the path has {count} places, but needs {least} or more")]
    TooFew {
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
    #[error("the last place of a loop must be the first one, but is {gap_mm:.3} mm away from it")]
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

impl Trajectory {
    /// Returns the trajectory along straight lines between the waypoints, with rounded corners.
    /// Waypoints within a fifth of the tolerance of the line between others make no corner, unless
    /// the speed changes there. A loop
    /// goes from the last waypoint back to the first one, and begins in the middle of the first
    /// side, or near to it where waypoints are dense. The ball stops at a turn of more than 160°
    /// and where a waypoint is repeated.
    ///
    /// # Errors
    /// Where there are fewer than two waypoints in different places, or a number is out of its
    /// range; where the ball is under way for more than a day.
    pub fn through(waypoints: &Waypoints, limits: &Limits, run: Run) -> Result<Self, PathError> {
        let Waypoints { places, speeds, tolerance } = waypoints;
        check_near(places)?;
        if let Some(&value) =
            speeds.iter().find(|it| !(LIMITS.contains(it) || **it == f64::INFINITY))
        {
            return Err(PathError::Limit { name: "speed", value });
        }
        if !(0.0..=MAX_COORDINATE_M).contains(tolerance) {
            return Err(PathError::Far { name: "the tolerance", value: *tolerance });
        }
        Self::along(blend(waypoints, run)?, limits)
    }

    /// Returns the trajectory along a curve; a loop where the curve is closed.
    pub(crate) fn along(curve: Curve, limits: &Limits) -> Result<Self, PathError> {
        limits.check()?;
        let profile = Profile::new(&curve, limits);
        let law = match curve.is_closed {
            true => TimeLaw::round(&profile, LONGEST_S),
            false => TimeLaw::once(&profile),
        };
        Self::of_possible_length(Kind::Curve(curve, law))
    }

    /// Returns the trajectory.
    ///
    /// # Errors
    /// [`PathError::TooLong`] where it takes longer than a day, or its time is no number.
    fn of_possible_length(kind: Kind) -> Result<Self, PathError> {
        let trajectory = Self { kind };
        let span = trajectory.span();
        if span <= LONGEST_S {
            Ok(trajectory)
        } else {
            Err(PathError::TooLong { hours: span / 3600.0 })
        }
    }

    /// Returns the smooth interpolation of samples by polynomials of degree 3, at rest at both ends
    /// (degree 4 there). It begins at the time of the first sample. A loop reaches the times of its
    /// samples after a start of 2 s, in which its clock goes slower.
    ///
    /// # Errors
    /// Where there are fewer than two samples (a loop: four), the times do not rise, a loop does
    /// not end where it begins, or a number is not finite; where it takes more than a day.
    pub fn through_samples(samples: &[Sample], run: Run) -> Result<Self, PathError> {
        check_near(samples.iter().map(|sample| &sample.position))?;
        if !samples.iter().all(|sample| sample.time.is_finite()) {
            return Err(PathError::NotFinite);
        }
        Self::of_possible_length(Kind::Timed(Timed::new(samples, run)?))
    }

    /// Returns the motion at a time after the begin, seconds. Before 0 the ball rests at the begin,
    /// after [`duration`](Self::duration) at the end.
    pub fn at(&self, time: f64) -> Moment {
        match &self.kind {
            Kind::Timed(timed) => timed.at(time),
            Kind::Curve(curve, law) => {
                let motion = law.at(time);
                let point = curve.at(motion.s);
                let along = point.tangent * motion.acceleration;
                Moment {
                    position: Point3::from(point.place),
                    velocity: point.tangent * motion.speed,
                    acceleration: along + point.curvature * (motion.speed * motion.speed),
                }
            }
        }
    }

    /// Returns whether the trajectory goes round without an end.
    pub fn is_loop(&self) -> bool {
        self.period().is_some()
    }

    /// Returns the time of the end, seconds; infinite for a loop.
    pub fn duration(&self) -> f64 {
        match &self.kind {
            _ if self.is_loop() => f64::INFINITY,
            Kind::Timed(timed) => timed.duration(),
            Kind::Curve(_, law) => law.duration(),
        }
    }

    /// Returns the time of a lap after the start, seconds; `None` where the trajectory has an end.
    pub fn period(&self) -> Option<f64> {
        match &self.kind {
            Kind::Timed(timed) => timed.period(),
            Kind::Curve(_, law) => law.laps.map(|laps| laps.period),
        }
    }

    /// Returns times, seconds, in their order from 0 to [`span`](Self::span), between which the
    /// motion has no jump of the acceleration's change.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let span = self.span();
        let mut breaks = match &self.kind {
            Kind::Timed(timed) => timed.breaks(),
            Kind::Curve(_, law) => law.jumps().collect(),
        };
        breaks.retain(|time| *time > 0.0 && *time < span);
        breaks.insert(0, 0.0);
        breaks.push(span);
        breaks
    }

    /// Returns the time after which the trajectory holds nothing new, seconds: its end, or the end
    /// of the first lap at full speed.
    pub fn span(&self) -> f64 {
        match &self.kind {
            Kind::Timed(timed) => timed.span(),
            Kind::Curve(_, law) => law.laps.map_or(law.duration(), |laps| laps.begin + laps.period),
        }
    }
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
