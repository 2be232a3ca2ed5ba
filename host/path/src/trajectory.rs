//! Trajectories: place, velocity and acceleration over time.

use nalgebra::Point3;

use crate::corner::blend;
use crate::curve::Curve;
use crate::motion::{LIMITS, check_near};
use crate::profile::Profile;
use crate::time_law::TimeLaw;
use crate::timed::Timed;

pub use crate::motion::{
    DEFAULT_ACCELERATION, DEFAULT_JERK, MAX_COORDINATE_M, Moment, MotionLimits, PathError, Run,
    Sample, Waypoints,
};

/// Longest trajectory, seconds; of a loop its first lap.
const LONGEST_S: f64 = 24.0 * 3600.0;

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
    pub fn through(
        waypoints: &Waypoints,
        limits: &MotionLimits,
        run: Run,
    ) -> Result<Self, PathError> {
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
    pub(crate) fn along(curve: Curve, limits: &MotionLimits) -> Result<Self, PathError> {
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

    /// Returns the motion at a time after the start, seconds. Before 0 the ball rests at the start,
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

    /// Returns the length, metres; of a loop that of a lap.
    pub fn length(&self) -> f64 {
        match &self.kind {
            Kind::Curve(curve, _) => curve.length(),
            Kind::Timed(timed) => timed.length(),
        }
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
