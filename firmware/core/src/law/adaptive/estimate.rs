//! Estimates of the ball's position and of the Jacobian, and the steps that follow from them.

use super::bend;
use crate::law::axis_kalman::{AxisKalman, MAX_HELD};
use crate::law::fixed_point::{excess_bits, movement, squared_length, times};
use crate::law::io::Measurement;
use crate::law::signs::SIGNS;
use crate::law::solve::{J_BITS, solve};

/// Prior of the Jacobian: a rig a metre wide with its ball half a metre below the motors and
/// pulleys of 17 mm. In x one cable works against two.
struct JacobianPrior {
    /// Mean of |J|, µm/step, x, y, z by cable A, B, C.
    mean: [[i32; 3]; 3],
    /// Variance that the entries of a row have in common (the pulleys' size, for one), in 1/256 of
    /// their mean squared.
    common: i32,
    /// Variance of each entry alone, by row, in 1/256 of its mean squared. In y the two entries are
    /// nearly the same.
    own: [i32; 3],
    /// Standard deviation of J_yC, which is zero on a level rig, µm/step.
    level_sd: i32,
    /// Process noise of J_yC, as a share of the others' in 1/256: 0.09.
    level_noise: i32,
}

const PRIOR: JacobianPrior = JacobianPrior {
    mean: [[270, 270, 540], [510, 510, 0], [330, 330, 330]],
    common: 77,
    own: [102, 26, 102],
    level_sd: 90,
    level_noise: 23,
};

/// Largest doubt of steps that are used, Q8: their mean is three standard deviations.
const MAX_DOUBT: u32 = 85;
/// Unsure share of a distance over its doubt squared, Q8.
const UNSURE_PER_DOUBT2: u32 = 7;
/// Largest unsure share of a distance, Q8.
const MAX_UNSURE: u32 = 192;
/// Noise of J while the target rests, in 1/32: all of it.
const FULL_NOISE: i64 = 32;
/// Noise of J while the target moves, in 1/32: what [`bend`] does not tell of J's change.
const FOLLOWING_NOISE: i64 = 1;
/// Distance from the target below which the ball counts as held, µm.
const HELD_UM: i64 = 3_000;

/// Steps that lead nearer to the target with enough certainty.
pub(super) struct Steps {
    /// Motor steps to the target, Q8.
    pub(super) n: [i32; 3],
    /// Share of the distance that braking must not count on, Q8: J may be larger than estimated.
    pub(super) unsure: u32,
}

/// Kalman filters of p and J.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Estimate {
    /// The filters of x, y and z.
    pub(super) axes: [AxisKalman; 3],
    /// Motor positions of the last measurement, Q4 steps.
    motors: [i32; 3],
    /// Number of consecutive measurements, at most [`MAX_HELD`], that came while the ball was held
    /// at its target.
    held: u8,
}

impl Estimate {
    /// Creates the estimate at the first measurement, with the prior of J.
    pub(super) fn new(measurement: &Measurement) -> Self {
        let axis = |i: usize| {
            let zero = |k: usize| SIGNS[i][k] == 0;
            let row = [0, 1, 2].map(|k| SIGNS[i][k] * PRIOR.mean[i][k]);
            // (µm/step)² in 1/256, which is Q8: 26 bits.
            let p_jj = [0, 1, 2].map(|k| {
                [0, 1, 2].map(|l| match (k == l, zero(k)) {
                    (true, true) => (PRIOR.level_sd * PRIOR.level_sd) << 8,
                    (true, false) => row[k] * row[k] * (PRIOR.common + PRIOR.own[i]),
                    (false, _) => row[k] * row[l] * PRIOR.common,
                })
            });
            let noise = [0, 1, 2].map(|k| if zero(k) { PRIOR.level_noise } else { 256 });
            let (ball, variance) = (measurement.ball[i], measurement.variances[i]);
            AxisKalman::new(ball, row.map(|j| j << 6), p_jj, variance, noise)
        };
        // A step moves the ball in z the more, the nearer it is to the motors' plane.
        let axes = [axis(0), axis(1), axis(2).with_scale_noise()];
        Self { axes, motors: measurement.motors, held: 0 }
    }

    /// Updates the filters by a measurement.
    pub(super) fn update(&mut self, measurement: &Measurement) {
        let turned = [0, 1, 2].map(|k| measurement.motors[k].saturating_sub(self.motors[k]));
        self.motors = measurement.motors;
        let is_held = !measurement.is_moving() && self.holds(measurement.target);
        self.held = if is_held { (self.held + 1).min(MAX_HELD) } else { 0 };
        let noise = if measurement.is_moving() { FOLLOWING_NOISE } else { FULL_NOISE };
        let change = if measurement.is_moving() {
            bend::change(&self.axes.map(|axis| axis.j), turned)
        } else {
            [[0; 3]; 3]
        };
        for (i, axis) in self.axes.iter_mut().enumerate() {
            axis.predict(turned, noise);
            axis.change_row(change[i]);
            let (ball, variance) = (measurement.ball[i], measurement.variances[i]);
            match self.held {
                0 => axis.update(ball, variance),
                n => axis.update_held(ball, variance, n),
            }
        }
    }

    /// Returns whether the estimated position is at the target.
    fn holds(&self, target: [i32; 3]) -> bool {
        let e = [0, 1, 2].map(|i| (self.axes[i].p >> 4).saturating_sub(target[i]));
        squared_length(e) < HELD_UM * HELD_UM
    }

    /// Returns J (Q6 µm/step) with every entry of Σ's sign and at least a hundredth of the
    /// largest. Such a matrix can be inverted (Proposition 1).
    pub(super) fn projected(&self) -> [[i32; 3]; 3] {
        let j = self.axes.map(|axis| axis.j);
        let least = j.iter().flatten().map(|j| j.abs()).max().unwrap_or(0) / 100;
        [0, 1, 2].map(|i| {
            [0, 1, 2].map(|k| match SIGNS[i][k] {
                0 => j[i][k],
                sign => sign * (sign * j[i][k]).max(least).max(1),
            })
        })
    }

    /// Returns target minus position, µm, where the position is the one after the motors' coming
    /// movement.
    pub(super) fn predicted_error(&self, j: &[[i32; 3]; 3], measurement: &Measurement) -> [i32; 3] {
        let ahead = measurement.motors_ahead;
        let due = [0, 1, 2].map(|k| i64::from(ahead[k].saturating_sub(self.motors[k])));
        [0, 1, 2].map(|i| {
            // Bits: J 19, steps in Q4 at most 26.
            let ball = (i64::from(self.axes[i].p) + movement(j[i], due)) >> 4;
            (i64::from(measurement.target[i]) - ball).clamp(-(1 << 23), 1 << 23) as i32
        })
    }

    /// Returns the steps that correct `e`; `None` where they may not lead nearer.
    pub(super) fn steps(&self, j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<Steps> {
        let n = self.cautious_steps(j, e)?;
        let doubt = self.doubt(j, e, n)?;
        let unsure = ((UNSURE_PER_DOUBT2 * doubt * doubt) >> 8).min(MAX_UNSURE);
        (doubt < MAX_DOUBT).then_some(Steps { n, unsure })
    }

    /// Returns the n (steps, Q8) that minimises E|e - J n|² over the distribution of J: (Ĵ'Ĵ +
    /// Σ P_JJ) n = Ĵ'e. Where J is known this is the Gauss-Newton step; motors of unknown effect
    /// turn little.
    pub(super) fn cautious_steps(&self, j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<[i32; 3]> {
        let dropped = excess_bits(j.iter().flatten().copied(), J_BITS).max(0) as u32;
        let j = j.map(|row| row.map(|v| i64::from(v >> dropped)));
        // Bits: 14 + 14, 30 the sum. J is in Q6 less `dropped` bits, its square in Q12; P_JJ in Q8:
        // 30 bits, 32 the sum.
        let entry = |k: usize, l: usize| {
            let square: i64 = (0..3).map(|i| times(j[i][k], j[i][l])).sum();
            let unknown: i64 = self.axes.iter().map(|axis| i64::from(axis.p_jj[k][l])).sum();
            square + ((unknown << 4) >> (2 * dropped))
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        let normal = [[entry(0, 0), ab, ac], [ab, entry(1, 1), bc], [ac, bc, entry(2, 2)]];
        // Bits: 14 + 23, 39 the sum; to Q6, the format of the left side over J in Q6.
        let right =
            [0, 1, 2].map(|k| (0..3).map(|i| times(j[i][k], e[i].into())).sum::<i64>() >> dropped);
        let bits = |v: &i64| 64 - v.unsigned_abs().leading_zeros();
        let longest = normal.iter().flatten().chain(&right).map(bits).max().unwrap_or(0);
        let excess = longest.saturating_sub(31);
        solve(
            &normal.map(|row| row.map(|v| (v >> excess) as i32)),
            right.map(|v| (v >> excess) as i32),
        )
    }

    /// Returns the standard deviation of e'J n over its mean, Q8, for the steps `n` (Q8) and the
    /// distribution of J: the variance is Σ e_i² var(J_i n). At most 1; `None` where the mean is
    /// not above zero.
    pub(super) fn doubt(&self, j: &[[i32; 3]; 3], e: [i32; 3], n: [i32; 3]) -> Option<u32> {
        // The ratio does not depend on the lengths of e and n: 12 and 13 bits of them are enough.
        let [e, n] = [(e, 12), (n, 13)].map(|(v, bits)| {
            let dropped = excess_bits(v.into_iter(), bits).max(0);
            v.map(|v| v >> dropped)
        });
        let variances = [0, 1, 2].map(|i| self.axes[i].variance_of(n));
        let longest = variances.iter().map(|v| 64 - v.leading_zeros()).max().unwrap_or(0);
        // An even number of bits is dropped; the root drops half as many.
        let half = longest.saturating_sub(23) / 2;
        // Bits: 24 + 24, 50 the sum.
        let variance: i64 = (0..3)
            .map(|i| {
                let square = times(e[i].into(), e[i].into());
                times(square, (variances[i] >> (2 * half)) as i64)
            })
            .sum();
        // Bits: J 19 + 13, 34 the sum; 28 + 12.
        let moves = j.map(|row| movement(row, n.map(i64::from)));
        let mean: i64 = (0..3).map(|i| times(e[i].into(), moves[i])).sum();
        // `variance_of` returns quarters, so the root is doubled. Bits: 25 + 14 + 1.
        let deviation = (variance.unsigned_abs().isqrt() as i64) << (half + 1);
        if mean <= 0 {
            return None;
        }
        // 22 bits of both (the smaller is not longer) + 8 for Q8: a division of 32 bits.
        let dropped = 42u32.saturating_sub(mean.leading_zeros());
        let [deviation, mean] = [deviation.min(mean), mean].map(|v| (v >> dropped) as u32);
        Some((deviation << 8) / mean)
    }
}
