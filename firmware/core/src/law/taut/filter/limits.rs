//! Limits of the state, and inflation of a covariance that is too small.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns go by their numbers in several arrays at once"
)]

use super::Filter;
use crate::law::taut::prior::{DELAY, N, STEP};

/// Largest distance of a motor from the ball along an axis, mm.
const MAX_MOTOR_DISTANCE_MM: f32 = 1600.0;
/// Range of ln s: cable of a step from 0.1 to 1.5 mm.
const LN_STEP_RANGE: (f32, f32) = (-core::f32::consts::LN_10, 0.405_465);
/// Range of the measurements' delay beyond their age, frame times.
const DELAY_RANGE: (f32, f32) = (-1.0, 5.0);
/// Standard deviation of a motor's coordinate below which the filter is confident, mm.
const CONFIDENT_MOTOR_MM: f32 = 260.0;
/// Standard deviation of ln s below which the filter is confident.
const CONFIDENT_LN_STEP: f32 = 0.4;
/// Factor on the standard deviations of the geometry where a confident filter is biased.
const INFLATION: f32 = 1.05;

/// Bounds on the motors' positions relative to the ball and to each other, mm: A and B on the side
/// of larger x, C opposite, A at larger y than B, all above the ball.
struct MotorBounds {
    /// Least height of a motor above the ball.
    min_height: f32,
    /// Least distance along x from the ball.
    min_x: f32,
    /// Least y of A, and the negative of the largest y of B, relative to the ball.
    min_y: f32,
    /// Least distance along y of A from B.
    min_apart: f32,
}

const BOUNDS: MotorBounds =
    MotorBounds { min_height: 60.0, min_x: 15.0, min_y: -100.0, min_apart: 250.0 };

impl Filter {
    /// Returns whether the variances of the geometry are small.
    pub(super) fn is_confident(&self) -> bool {
        (3..STEP).all(|i| self.p[i][i] < CONFIDENT_MOTOR_MM * CONFIDENT_MOTOR_MM)
            && self.p[STEP][STEP] < CONFIDENT_LN_STEP * CONFIDENT_LN_STEP
    }

    /// Inflates the covariance of the geometry: the innovations are biased.
    pub(super) fn inflate_covariance(&mut self) {
        for i in 0..N {
            for k in 0..N {
                let factor =
                    if i >= 3 { INFLATION } else { 1.0 } * if k >= 3 { INFLATION } else { 1.0 };
                self.p[i][k] *= factor;
            }
        }
    }

    /// Clamps the state to [`BOUNDS`] and to the ranges of the other entries.
    pub(super) fn clamp_state(&mut self) {
        let x = &mut self.x;
        let ball = [x[0], x[1], x[2]];
        for z in [5, 8, 11] {
            x[z] = x[z].max(ball[2] + BOUNDS.min_height);
        }
        x[3] = x[3].max(ball[0] + BOUNDS.min_x);
        x[6] = x[6].max(ball[0] + BOUNDS.min_x);
        x[9] = x[9].min(ball[0] - BOUNDS.min_x);
        x[4] = x[4].max(ball[1] + BOUNDS.min_y);
        x[7] = x[7].min(ball[1] - BOUNDS.min_y);
        x[4] = x[4].max(x[7] + BOUNDS.min_apart);
        x[10] = x[10].max(x[7]).min(x[4]);
        for i in 3..STEP {
            let centre = ball[i % 3];
            x[i] = x[i].max(centre - MAX_MOTOR_DISTANCE_MM).min(centre + MAX_MOTOR_DISTANCE_MM);
        }
        x[DELAY] = x[DELAY].max(DELAY_RANGE.0).min(DELAY_RANGE.1);
        x[STEP] = x[STEP].max(LN_STEP_RANGE.0).min(LN_STEP_RANGE.1);
    }
}
