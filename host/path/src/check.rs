//! Check of a trajectory before the ball moves.

use std::error::Error;

use nalgebra::Point3;
use thiserror::Error;

use crate::trajectory::{Limits, Moment, Trajectory};

/// Time between two checked moments, seconds.
const STEP_S: f64 = 0.005;

/// Share by which a trajectory may exceed a limit: rounding.
const SLACK: f64 = 1e-6;

/// First moment at which a trajectory breaks a rule.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "the path is not possible at [{:.4}, {:.4}, {:.4}] m, {distance_m:.3} m and {time_s:.2} s \
     after its begin", position.x, position.y, position.z
)]
pub struct Breach<E: Error + 'static> {
    /// Time after the begin, seconds.
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

/// Checks a trajectory every 5 ms, a loop until the end of its first lap at full speed. `rule`
/// returns an error for a motion that must not be, for example in a place without cables.
///
/// # Errors
/// The first breach of a rule.
pub fn check<E: Error + 'static>(
    trajectory: &Trajectory,
    limits: &Limits,
    rule: impl Fn(&Moment) -> Result<(), E>,
) -> Result<(), Breach<E>> {
    let steps = (trajectory.span() / STEP_S).ceil() as u64;
    let mut distance_m = 0.0;
    let mut last = trajectory.at(0.0).position;
    for step in 0..=steps {
        let time_s = STEP_S * step as f64;
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

fn check_moment<E: Error + 'static>(
    moment: &Moment,
    limits: &Limits,
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
