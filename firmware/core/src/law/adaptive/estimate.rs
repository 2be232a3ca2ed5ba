//! What is known of the ball and of how the motors move it, and the steps that follow from it.

use crate::law::axis::{Axis, HELD_MOST};
use crate::law::fixed_point::{excess_bits, squared_length, times};
use crate::law::io::Measurement;
use crate::law::signs::SIGNS;
use crate::law::solve::{J_BITS, solve};

/// The first guess of |J|, µm/step: a rig a metre wide with its ball half a metre below the motors
/// and pulleys of 17 mm. In x one cable works against two.
const GUESS: [[i32; 3]; 3] = [[270, 270, 540], [510, 510, 0], [330, 330, 330]];
/// Variance of that, in 1/256 of its square: of what a row's entries have in common, the pulleys'
/// size for one, and of what each has for itself. In y the two are nearly the same.
const COMMON: i32 = 77;
const OWN: [i32; 3] = [102, 26, 102];
/// What J_yC, which is zero on a level rig, may be instead, µm/step.
const ASKEW: i32 = 90;
/// From this doubt on, Q8, a step is not certain: its mean is three standard deviations.
const DOUBTFUL: u32 = 85;
/// This times the doubt squared of a way is unsure, and at most so much of it, Q8.
const UNSURE: u32 = 7;
const UNSURE_MOST: u32 = 192;
/// Nearer than this the ball is held, µm.
const HELD: i64 = 3_000;

/// Steps that are certain enough.
pub(super) struct Steps {
    /// Still to go, Q8.
    pub(super) n: [i32; 3],
    /// What of the way is not to be braked on, Q8: J may be larger than it seems.
    pub(super) unsure: u32,
}

/// Kalman filters for p and J.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Estimate {
    pub(super) axes: [Axis; 3],
    /// Where the motors were for it, Q4 steps.
    motors: [i32; 3],
    /// The number of pictures in a row, up to [`HELD_MOST`], before which the ball was known to be
    /// at its target.
    held: u8,
}

impl Estimate {
    /// At the first measurement: with the J of a usual rig.
    pub(super) fn new(measurement: &Measurement) -> Self {
        let axis = |i: usize| {
            let zero = |k: usize| SIGNS[i][k] == 0;
            let row = [0, 1, 2].map(|k| SIGNS[i][k] * GUESS[i][k]);
            // (µm/step)² in 1/256, which is Q8: 26 bits.
            let p_jj = [0, 1, 2].map(|k| {
                [0, 1, 2].map(|l| match (k == l, zero(k)) {
                    (true, true) => (ASKEW * ASKEW) << 8,
                    (true, false) => row[k] * row[k] * (COMMON + OWN[i]),
                    (false, _) => row[k] * row[l] * COMMON,
                })
            });
            // 0.09 of the others' noise.
            let noise = [0, 1, 2].map(|k| if zero(k) { 23 } else { 256 });
            Axis::new(
                measurement.ball[i],
                row.map(|j| j << 6),
                p_jj,
                measurement.variances[i],
                noise,
            )
        };
        // A step moves the ball in z the more the nearer it is to the motors' plane.
        Self { axes: [axis(0), axis(1), axis(2).scaling()], motors: measurement.motors, held: 0 }
    }

    /// Takes in a measurement.
    pub(super) fn update(&mut self, measurement: &Measurement) {
        let turned = [0, 1, 2].map(|k| measurement.motors[k].saturating_sub(self.motors[k]));
        self.motors = measurement.motors;
        self.held = if self.holds(measurement.target) { (self.held + 1).min(HELD_MOST) } else { 0 };
        for (i, axis) in self.axes.iter_mut().enumerate() {
            axis.turned(turned);
            let (ball, variance) = (measurement.ball[i], measurement.variances[i]);
            match self.held {
                0 => axis.measured(ball, variance),
                n => axis.held(ball, variance, n),
            }
        }
    }

    /// Whether the ball was at the target, as far as that was known before the measurement.
    fn holds(&self, target: [i32; 3]) -> bool {
        squared_length([0, 1, 2].map(|i| (self.axes[i].p >> 4).saturating_sub(target[i])))
            < HELD * HELD
    }

    /// J, every entry of Σ's sign and at least a hundredth of the largest: then it can be inverted
    /// (Proposition 1).
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

    /// target - where the ball will be when the motors have done what they are about to, µm.
    pub(super) fn ahead(&self, j: &[[i32; 3]; 3], measurement: &Measurement) -> [i32; 3] {
        let due = [0, 1, 2]
            .map(|k| i64::from(measurement.motors_ahead[k].saturating_sub(self.motors[k])));
        [0, 1, 2].map(|i| {
            // Bits: J 19, steps in Q4 at most 26; Q10 to Q4.
            let moves: i64 = (0..3).map(|k| times(j[i][k].into(), due[k])).sum::<i64>() >> 6;
            let ball = (i64::from(self.axes[i].p) + moves) >> 4;
            (i64::from(measurement.target[i]) - ball).clamp(-(1 << 23), 1 << 23) as i32
        })
    }

    /// The steps to go, if they are certain enough to lead nearer.
    pub(super) fn steps(&self, j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<Steps> {
        let n = self.cautious(j, e)?;
        let doubt = self.doubt(j, e, n)?;
        let unsure = ((UNSURE * doubt * doubt) >> 8).min(UNSURE_MOST);
        (doubt < DOUBTFUL).then_some(Steps { n, unsure })
    }

    /// The n (steps, Q8) that makes E|e - J n|² the least over what J may be: (Ĵ'Ĵ + Σ P_JJ) n =
    /// Ĵ'e. Where J is known it is Gauss-Newton's; where it is not, it turns motors little of which
    /// nobody knows what they do.
    pub(super) fn cautious(&self, j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<[i32; 3]> {
        let few = excess_bits(j.iter().flatten().copied(), J_BITS).max(0) as u32;
        let j = j.map(|row| row.map(|v| i64::from(v >> few)));
        // Bits: 14 + 14, 30 the sum; J is in Q6 less `few`, its square in Q12. P_JJ: 30, 32 the
        // sum; Q8.
        let entry = |k: usize, l: usize| {
            let square: i64 = (0..3).map(|i| times(j[i][k], j[i][l])).sum();
            let unknown: i64 = self.axes.iter().map(|axis| i64::from(axis.p_jj[k][l])).sum();
            square + ((unknown << 4) >> (2 * few))
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        let normal = [[entry(0, 0), ab, ac], [ab, entry(1, 1), bc], [ac, bc, entry(2, 2)]];
        // Bits: 14 + 23, 39 the sum; to Q6, as e is of a J in Q6.
        let right =
            [0, 1, 2].map(|k| (0..3).map(|i| times(j[i][k], e[i].into())).sum::<i64>() >> few);
        let bits = |v: &i64| 64 - v.unsigned_abs().leading_zeros();
        let longest = normal.iter().flatten().chain(&right).map(bits).max().unwrap_or(0);
        let fewer = longest.saturating_sub(31);
        solve(
            &normal.map(|row| row.map(|v| (v >> fewer) as i32)),
            right.map(|v| (v >> fewer) as i32),
        )
    }

    /// The standard deviation of e'J n over its mean, Q8, for the steps `n` (Q8) and what J may be:
    /// its variance is Σ e_i² var(J_i n). At most 1, and `None` where the mean is not above zero.
    pub(super) fn doubt(&self, j: &[[i32; 3]; 3], e: [i32; 3], n: [i32; 3]) -> Option<u32> {
        // Neither the size of e nor that of n matters: 12 and 13 bits of them.
        let [e, n] = [(e, 12), (n, 13)].map(|(v, bits)| {
            let fewer = excess_bits(v.into_iter(), bits).max(0);
            v.map(|v| v >> fewer)
        });
        let variances = [0, 1, 2].map(|i| self.axes[i].variance_of(n));
        let longest = variances.iter().map(|v| 64 - v.leading_zeros()).max().unwrap_or(0);
        // An even number of bits, of which the root has half.
        let half = longest.saturating_sub(23) / 2;
        // Bits: 24 + 24, 50 the sum.
        let variance: i64 = (0..3)
            .map(|i| {
                let square = times(e[i].into(), e[i].into());
                times(square, (variances[i] >> (2 * half)) as i64)
            })
            .sum();
        let falls: i64 = (0..3)
            .map(|i| {
                // Bits: J 19 + 13, 34 the sum; Q6, and 28 + 12.
                let moves: i64 = (0..3).map(|k| times(j[i][k].into(), n[k].into())).sum();
                times(e[i].into(), moves >> 6)
            })
            .sum();
        // Variances are in quarters. Bits: 25 + 14 + 1.
        let deviation = (variance.unsigned_abs().isqrt() as i64) << (half + 1);
        if falls <= 0 {
            return None;
        }
        // Bits of both, as the smaller is not more: 22 + 8 is what a division of 32 takes.
        let fewer = 42u32.saturating_sub(falls.leading_zeros());
        let [deviation, falls] = [deviation.min(falls), falls].map(|v| (v >> fewer) as u32);
        Some((deviation << 8) / falls)
    }
}
