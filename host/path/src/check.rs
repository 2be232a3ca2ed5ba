//! Check of a trajectory before the ball moves.

use std::error::Error;

use nalgebra::Point3;
use thiserror::Error;

use crate::trajectory::{Moment, MotionLimits, Trajectory};

/// Time between two checked moments, seconds.
const STEP_S: f64 = 0.005;

/// Greatest number of moments that are checked, about: 0.3 s of a computer's time. A path of hours
/// has fewer moments between two of its corners or places.
const MOST_MOMENTS: usize = 300_000;

/// Greatest number of moments between two breaks, where the motion is a polynomial of low degree.
const MOST_PARTS: usize = 200;

/// Share by which a trajectory may exceed a limit: rounding.
const SLACK: f64 = 1e-6;

/// First moment at which a trajectory breaks a rule.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "the path is not possible at [{:.4}, {:.4}, {:.4}] m, {distance_m:.3} m and {time_s:.2} s \
     after its start", position.x, position.y, position.z
)]
pub struct Breach<E: Error + 'static> {
    /// Time after the start, seconds.
    pub time_s: f64,
    /// Distance along the path, metres.
    pub distance_m: f64,
    /// Place, metres.
    pub position: Point3<f64>,
    /// Broken rule.
    #[source]
    pub rule: Rule<E>,
}

/// Rule that a trajectory breaks.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Rule<E: Error + 'static> {
    /// A rule of the caller.
    #[error(transparent)]
    Other(E),
    /// The ball is too fast.
    #[error("the speed is {value:.3} m/s, above {limit} m/s: give the path more time")]
    Speed {
        /// Speed, m/s.
        value: f64,
        /// Limit, m/s.
        limit: f64,
    },
    /// The acceleration is too large.
    #[error(
        "the acceleration is {value:.3} m/s², above {limit} m/s²: give the path more time or \
         smoother turns"
    )]
    Acceleration {
        /// Acceleration, m/s².
        value: f64,
        /// Limit, m/s².
        limit: f64,
    },
}

/// Checks a trajectory every 5 ms, a loop until the end of its first lap at full speed; one of more
/// than 25 minutes less often, but between any two of its corners or places. `rule` returns an
/// error for a motion that must not be, for example in a place without cables.
///
/// # Errors
/// The first breach of a rule.
pub fn check<E: Error + 'static>(
    trajectory: &Trajectory,
    limits: &MotionLimits,
    rule: impl Fn(&Moment) -> Result<(), E>,
) -> Result<(), Breach<E>> {
    let mut distance_m = 0.0;
    let mut last = trajectory.at(0.0).position;
    for time_s in times(&trajectory.breaks()) {
        let moment = trajectory.at(time_s);
        distance_m += (moment.position - last).norm();
        last = moment.position;
        check_moment(&moment, limits, &rule).map_err(|rule| Breach {
            time_s,
            distance_m,
            position: moment.position,
            rule,
        })?;
    }
    Ok(())
}

/// Returns the times to check, from the first break to the last one.
fn times(breaks: &[f64]) -> impl Iterator<Item = f64> {
    let most = (MOST_MOMENTS / breaks.len()).clamp(1, MOST_PARTS);
    let parts = move |pair: &[f64]| {
        let (from, span) = (pair[0], pair[1] - pair[0]);
        let count = ((span / STEP_S).ceil() as usize).clamp(1, most);
        (0..count).map(move |part| from + span * part as f64 / count as f64)
    };
    breaks.windows(2).flat_map(parts).chain(breaks.last().copied())
}

fn check_moment<E: Error + 'static>(
    moment: &Moment,
    limits: &MotionLimits,
    rule: impl Fn(&Moment) -> Result<(), E>,
) -> Result<(), Rule<E>> {
    rule(moment).map_err(Rule::Other)?;
    let (value, limit) = (moment.velocity.norm(), limits.speed);
    if value > limit * (1.0 + SLACK) {
        return Err(Rule::Speed { value, limit });
    }
    let (value, limit) = (moment.acceleration.norm(), limits.acceleration);
    if value > limit * (1.0 + SLACK) {
        return Err(Rule::Acceleration { value, limit });
    }
    Ok(())
}
