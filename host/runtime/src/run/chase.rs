//! How the ball keeps up with a target that moves: whether it has caught up, and whether it lags.

use crate::deviation::PathPoint;

/// Time without a target after which the run says so, seconds.
pub(super) const PAUSE_S: f64 = 1.0;

/// Speed below which a target rests, m/s.
pub(super) const REST_SPEED: f64 = 1e-4;

/// Time for which the ball is far from a target in motion, less that for which it is not, after
/// which the run says so, seconds.
const LAG_S: f64 = 5.0;

/// Distance at which the ball lags behind a target in motion, in radii of a reached target.
const LAG_RADII: f64 = 2.0;

/// Time for which the ball must be at the target without a break to have caught up, seconds: a
/// target that passes the ball is gone before.
const CATCH_S: f64 = 0.25;

/// How the ball keeps up with the target, from picture to picture.
#[derive(Debug, Default)]
pub(super) struct Chase {
    /// Number of pictures with the ball while the board followed.
    pub(super) followed: u64,
    /// Number of those with the ball at the target.
    pub(super) near: u64,
    /// Time of the last picture, seconds of the path.
    last: Option<f64>,
    /// Time for which the ball has been at the target without a break, seconds.
    near_s: f64,
    has_caught_up: bool,
    /// Time for which the ball was far from a target in motion, less that for which it was not;
    /// seconds.
    lag_s: f64,
    is_lag_told: bool,
    is_lag_due: bool,
}

impl Chase {
    /// Begins anew: the board is to follow from now on. What was counted stays.
    pub(super) fn begin(&mut self) {
        (self.last, self.near_s, self.has_caught_up) = (None, 0.0, false);
    }

    /// Notes the distance of the ball from the target, in radii of a reached target.
    pub(super) fn note(&mut self, point: &PathPoint, radii: f64) {
        let passed = point.time - self.last.replace(point.time).unwrap_or(point.time);
        let passed = passed.clamp(0.0, PAUSE_S);
        let is_near = radii <= 1.0;
        self.followed += 1;
        self.near += u64::from(is_near);
        self.near_s = if is_near { self.near_s + passed } else { 0.0 };
        self.has_caught_up |= self.near_s >= CATCH_S;
        if point.velocity.norm() > REST_SPEED {
            let change = if radii > LAG_RADII { passed } else { -passed };
            self.lag_s = (self.lag_s + change).max(0.0);
            self.is_lag_told &= self.lag_s > 0.0;
            self.is_lag_due |=
                self.lag_s > LAG_S && !std::mem::replace(&mut self.is_lag_told, true);
        }
    }

    /// Returns whether it is to be told that the ball lags: once, until the ball has made up for
    /// it.
    pub(super) fn take_lag(&mut self) -> bool {
        std::mem::take(&mut self.is_lag_due)
    }

    /// Returns whether the ball has caught up since the board began to follow the target.
    pub(super) fn has_caught_up(&self) -> bool {
        self.has_caught_up
    }
}
