//! Estimates of the ball's position and of the Jacobian, its change as the ball moves, and the
//! steps that follow from them.

use plumb_protocol::dimension::{AXES, LEAST_MOTORS, MOTORS, PerAxis, PerMotor};
use plumb_protocol::prior::JacobianPrior;

use super::axis_kalman::{AxisKalman, MAX_HELD, MAX_TURN};
use super::fixed_point::{J_BITS, excess_bits, movement, solve, squared_length, times};
use crate::law::io::Measurement;
use crate::law::sign::signs;
use crate::vector::{per_axis, per_motor};

/// Guess of the Jacobian: a rig a metre wide with its ball half a metre below the motors and
/// pulleys of 17 mm. In x one cable works against two.
struct JacobianGuess {
    /// Mean of |J|, µm/step, x, y, z by cable A, B, C.
    mean: PerAxis<PerMotor<i32>>,
    /// Variance that the entries of a row have in common (the pulleys' size, for one), in 1/256 of
    /// their mean squared.
    common: i32,
    /// Variance of each entry alone, by row, in 1/256 of its mean squared. In y the two entries are
    /// nearly the same.
    own: PerAxis<i32>,
    /// Standard deviation of J_yC, which is zero on a level rig, µm/step.
    level_sd: i32,
    /// Process noise of J_yC, as a share of the others' in 1/256: 0.09.
    level_noise: i32,
}

const GUESS: JacobianGuess = JacobianGuess {
    mean: [[270, 270, 540], [510, 510, 0], [330, 330, 330]],
    common: 77,
    own: [102, 26, 102],
    level_sd: 90,
    level_noise: 23,
};

/// Guess of a rig of two motors: means and variances of |J| over the simulated rigs of
/// `PlanarPopulation`, which are 0.5 to 1.5 m wide with pulleys of 5 to 30 mm. The common variance
/// is 68 in y and 58 in z. These numbers are not critical: means of 380, or own variances of 26 and
/// 102, change the median time to the target by 0.2 % and its 99th percentile by 3 %.
const PLANAR_GUESS: JacobianGuess = JacobianGuess {
    mean: [[0; MOTORS], [460, 460, 0], [395, 395, 0]],
    common: 64,
    own: [0, 15, 30],
    level_sd: 0,
    level_noise: 0,
};

/// Largest covariance of two entries of J with which a filter begins, Q8 (µm/step)².
const MAX_COVARIANCE: i64 = 1 << 29;

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
    pub(super) n: PerMotor<i32>,
    /// Share of the distance that braking must not count on, Q8: J may be larger than estimated.
    pub(super) unsure: u32,
}

/// Kalman filters of p and J.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Estimate {
    /// The filters of x, y and z.
    pub(super) axes: PerAxis<AxisKalman>,
    /// Whether two motors move the ball in a plane: row x and column C of J are zero, for certain.
    is_planar: bool,
    /// Motor positions of the last measurement, Q4 steps.
    motors: PerMotor<i32>,
    /// Number of consecutive measurements, at most [`MAX_HELD`], that came while the ball was held
    /// at its target.
    held: u8,
}

/// Returns row `i` of the guess of J, µm/step, and its covariance in 1/256 (µm/step)², 26 bits.
fn guess(i: usize, is_planar: bool) -> (PerMotor<i32>, PerMotor<PerMotor<i32>>) {
    let (signs, guess) = (signs(is_planar), if is_planar { PLANAR_GUESS } else { GUESS });
    let row = per_motor(|k| signs[i][k] * guess.mean[i][k]);
    let covariance = per_motor(|k| {
        per_motor(|l| match (k == l, signs[i][k] == 0) {
            (true, true) => (guess.level_sd * guess.level_sd) << 8,
            (true, false) => row[k] * row[k] * (guess.common + guess.own[i]),
            (false, _) => row[k] * row[l] * guess.common,
        })
    });
    (row, covariance)
}

/// Returns row `i` of a host's J, as [`guess`], 29 bits. An absent motor has zeros.
fn known(i: usize, prior: &JacobianPrior) -> (PerMotor<i32>, PerMotor<PerMotor<i32>>) {
    let entry = |k: usize| prior.entries[i].get(k).copied().unwrap_or(0);
    let own = |k: usize| prior.deviations[i].get(k).map_or(0, |sd| (sd * sd) as i32);
    let row = per_motor(entry);
    // Bits: 12 + 8 each.
    let common = row.map(|j| (j * i32::from(prior.common)) >> 8);
    let covariance = per_motor(|k| {
        per_motor(|l| {
            let shared = i64::from(common[k]) * i64::from(common[l]);
            let own = if k == l { i64::from(own(k)) } else { 0 };
            ((shared + own) << 8).clamp(-MAX_COVARIANCE, MAX_COVARIANCE) as i32
        })
    });
    (row, covariance)
}

impl Estimate {
    /// Creates the estimate at the first measurement, with the `prior` of J or else the guess.
    pub(super) fn new(
        measurement: &Measurement,
        is_planar: bool,
        prior: Option<&JacobianPrior>,
    ) -> Self {
        let (signs, noises) = (signs(is_planar), if is_planar { PLANAR_GUESS } else { GUESS });
        let axis = |i: usize| {
            let (row, p_jj) = prior.map_or_else(|| guess(i, is_planar), |prior| known(i, prior));
            let noise = per_motor(|k| if signs[i][k] == 0 { noises.level_noise } else { 256 });
            let (ball, variance) = (measurement.ball[i], measurement.variances[i]);
            AxisKalman::new(ball, row.map(|j| j << 6), p_jj, variance, noise)
        };
        // A step moves the ball in z the more, the nearer it is to the motors' plane.
        let axes = [axis(0), axis(1), axis(2).with_scale_noise()];
        Self { axes, is_planar, motors: measurement.motors, held: 0 }
    }

    /// Updates the filters by a measurement.
    pub(super) fn update(&mut self, measurement: &Measurement) {
        let mut turned = per_motor(|k| measurement.motors[k].saturating_sub(self.motors[k]));
        if self.is_planar {
            // Motor C may have turned for an earlier configuration, when the position was captured.
            turned[LEAST_MOTORS..].fill(0);
        }
        self.motors = measurement.motors;
        let is_held = !measurement.is_moving() && self.holds(measurement.target);
        self.held = if is_held { (self.held + 1).min(MAX_HELD) } else { 0 };
        let noise = if measurement.is_moving() { FOLLOWING_NOISE } else { FULL_NOISE };
        let change = if measurement.is_moving() {
            bend(&self.axes.map(|axis| axis.j), turned, self.is_planar)
        } else {
            [[0; MOTORS]; AXES]
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
    fn holds(&self, target: PerAxis<i32>) -> bool {
        let e = per_axis(|i| (self.axes[i].p >> 4).saturating_sub(target[i]));
        squared_length(e) < HELD_UM * HELD_UM
    }

    /// Returns J (Q6 µm/step) with every entry of Σ's sign and at least a hundredth of the
    /// largest. Such a matrix can be inverted (Proposition 1).
    pub(super) fn projected(&self) -> PerAxis<PerMotor<i32>> {
        let (j, signs) = (self.axes.map(|axis| axis.j), signs(self.is_planar));
        let least = j.iter().flatten().map(|j| j.abs()).max().unwrap_or(0) / 100;
        per_axis(|i| {
            per_motor(|k| match signs[i][k] {
                0 => j[i][k],
                sign => sign * (sign * j[i][k]).max(least).max(1),
            })
        })
    }

    /// Returns target minus position, µm, where the position is the one after the motors' coming
    /// movement.
    pub(super) fn predicted_error(
        &self,
        j: &PerAxis<PerMotor<i32>>,
        measurement: &Measurement,
    ) -> PerAxis<i32> {
        let ahead = measurement.motors_ahead;
        let due = per_motor(|k| i64::from(ahead[k].saturating_sub(self.motors[k])));
        per_axis(|i| {
            // Bits: J 19, steps in Q4 at most 26.
            let ball = (i64::from(self.axes[i].p) + movement(j[i], due)) >> 4;
            (i64::from(measurement.target[i]) - ball).clamp(-(1 << 23), 1 << 23) as i32
        })
    }

    /// Returns the steps that correct `e`; `None` where they may not lead nearer.
    pub(super) fn steps(&self, j: &PerAxis<PerMotor<i32>>, e: PerAxis<i32>) -> Option<Steps> {
        let n = self.cautious_steps(j, e)?;
        let doubt = self.doubt(j, e, n)?;
        let unsure = ((UNSURE_PER_DOUBT2 * doubt * doubt) >> 8).min(MAX_UNSURE);
        (doubt < MAX_DOUBT).then_some(Steps { n, unsure })
    }

    /// Returns the n (steps, Q8) that minimises E|e - J n|² over the distribution of J: (Ĵ'Ĵ +
    /// Σ P_JJ) n = Ĵ'e. Where J is known this is the Gauss-Newton step; motors of unknown effect
    /// turn little.
    pub(super) fn cautious_steps(
        &self,
        j: &PerAxis<PerMotor<i32>>,
        e: PerAxis<i32>,
    ) -> Option<PerMotor<i32>> {
        let dropped = excess_bits(j.iter().flatten().copied(), J_BITS).max(0) as u32;
        let j = j.map(|row| row.map(|v| i64::from(v >> dropped)));
        // Bits: 14 + 14, 30 the sum. J is in Q6 less `dropped` bits, its square in Q12; P_JJ in Q8:
        // 30 bits, 32 the sum.
        let entry = |k: usize, l: usize| {
            let square: i64 = (0..AXES).map(|i| times(j[i][k], j[i][l])).sum();
            let unknown: i64 = self.axes.iter().map(|axis| i64::from(axis.p_jj[k][l])).sum();
            square + ((unknown << 4) >> (2 * dropped))
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        let (aa, bb) = (entry(0, 0), entry(1, 1));
        // Any size but zero keeps a motor at rest that the rig has not.
        let cc = if self.is_planar { aa } else { entry(2, 2) };
        let normal = [[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]];
        // Bits: 14 + 23, 39 the sum; to Q6, the format of the left side over J in Q6.
        let right =
            per_motor(|k| (0..AXES).map(|i| times(j[i][k], e[i].into())).sum::<i64>() >> dropped);
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
    pub(super) fn doubt(
        &self,
        j: &PerAxis<PerMotor<i32>>,
        e: PerAxis<i32>,
        n: PerMotor<i32>,
    ) -> Option<u32> {
        // The ratio does not depend on the lengths of e and n: 12 and 13 bits of them are enough.
        let [e, n] = [(e, 12), (n, 13)].map(|(v, bits)| {
            let dropped = excess_bits(v.into_iter(), bits).max(0);
            v.map(|v| v >> dropped)
        });
        let variances = per_axis(|i| self.axes[i].variance_of(n));
        let longest = variances.iter().map(|v| 64 - v.leading_zeros()).max().unwrap_or(0);
        // An even number of bits is dropped; the root drops half as many.
        let half = longest.saturating_sub(23) / 2;
        // Bits: 24 + 24, 50 the sum.
        let variance: i64 = (0..AXES)
            .map(|i| {
                let square = times(e[i].into(), e[i].into());
                times(square, (variances[i] >> (2 * half)) as i64)
            })
            .sum();
        // Bits: J 19 + 13, 34 the sum; 28 + 12.
        let moves = j.map(|row| movement(row, n.map(i64::from)));
        let mean: i64 = (0..AXES).map(|i| times(e[i].into(), moves[i])).sum();
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

/// Width of the motors' triangle in x and y, µm. Rigs that are half and twice as wide profit too;
/// on them the change is over- or underestimated.
const WIDTH_UM: i64 = 1_300_000;
/// Least width of the rig in J, Q6 µm/step: 20 µm/step.
const LEAST_J: i64 = 20 << 6;
/// Largest movement of the ball that counts, Q4 µm: 33 mm.
const MAX_MOVED: i64 = 1 << 19;
/// Largest relative change, Q20: a quarter.
const MAX_CHANGE: i64 = 1 << 18;

/// Returns the change of J (Q6 µm/step) as the ball moves while the motors turn by `turned` (Q4
/// steps).
///
/// With the lengths L_k of the cables and their change c for a step, U J = c, where row k of U is
/// the unit vector from motor k to the ball. The derivative of this equation is
///
/// ```text
/// dJ = J diag(c dn_k / L_k) - Σ_k J_k (J'dp)' / (c L_k)
/// ```
///
/// with the motors' steps dn, the ball's movement dp and the columns J_k. Neither c nor L_k are
/// known. J tells c L over the rig's width, and the ball's depth over the rig's width; the width is
/// assumed. The rest of the change is process noise of the filters.
fn bend(
    j: &PerAxis<PerMotor<i32>>,
    turned: PerMotor<i32>,
    is_planar: bool,
) -> PerAxis<PerMotor<i32>> {
    let turned = turned.map(|d| i64::from(d.clamp(-MAX_TURN, MAX_TURN)));
    // Bits: 19 + 13, 34 the sum.
    let moved = j.map(|row| movement(row, turned).clamp(-MAX_MOVED, MAX_MOVED));
    let j = j.map(|row| row.map(i64::from));
    // The ball's movement for a step of all three motors: 21 bits.
    let lowered = j.map(|row| row.iter().sum::<i64>());
    // c L over the width: the mean of those by x and by y; in a plane there is only y.
    let by_y = j[1][0].abs() + j[1][1].abs();
    let sideways = if is_planar { by_y >> 1 } else { (2 * j[0][2].abs() + by_y) >> 2 };
    let sideways = sideways.max(LEAST_J);
    let shortened = shortening(sideways, lowered[2]);
    // Relative changes in Q20.
    let stretched = per_motor(|k| {
        // Bits: 30 + 14; Q34 to Q20.
        (times(shortened, turned[k]) >> 14).clamp(-MAX_CHANGE, MAX_CHANGE)
    });
    let turned_away = per_motor(|k| {
        // Bits: 19 + 19, 40 the sum, 56 with the shift; over 19 + 21. Q26 over Q6.
        let along: i64 = (0..AXES).map(|i| times(j[i][k], moved[i])).sum();
        ((along << 16) / times(sideways, WIDTH_UM)).clamp(-MAX_CHANGE, MAX_CHANGE)
    });
    per_axis(|i| {
        per_motor(|k| {
            // Bits: 21 + 18, 40 the difference.
            let change = times(j[i][k], stretched[k]) - times(lowered[i], turned_away[k]);
            (change >> 20) as i32
        })
    })
}

/// Returns c / L, the relative change of a cable's length for a step, in Q30. A motor at the side
/// is a third of the squared width away in the square, so that L² is the depth's square and that.
fn shortening(sideways: i64, lowered: i64) -> i64 {
    // Bits: 42 + 14 over 42.
    let square = times(lowered, lowered);
    let flat = (square << 14) / (3 * times(sideways, sideways) + square);
    // Bits: 2 + 19 + 14 + 10; Q6 + Q14 + 10 bits.
    (times(3 * sideways, flat) << 10) / WIDTH_UM
}

#[cfg(test)]
mod tests {
    use super::*;

    type Matrix = [[f64; 3]; 3];

    /// Motors of a rig that is 1.3 m wide, mm.
    const SPATIAL: Matrix = [[1300.0, 1300.0, 0.0], [1300.0, 0.0, 0.0], [0.0, 650.0, 0.0]];
    /// Two motors that are 1.3 m apart, mm. A third one, far away, keeps the ball in their plane.
    const PLANAR: Matrix = [[0.0, 1300.0, 0.0], [0.0, 0.0, 0.0], [-1e12, 0.0, 0.0]];
    /// Cable for a step, mm.
    const STEP: f64 = 0.4;

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|i| a[i] * b[i]).sum()
    }

    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
    }

    /// Returns J of these motors at a place, mm/step. Column C is 0 in a plane.
    fn jacobian(motors: &Matrix, ball: [f64; 3]) -> Matrix {
        let units = motors.map(|motor| {
            let way = [0, 1, 2].map(|i| ball[i] - motor[i]);
            way.map(|w| w / dot(way, way).sqrt())
        });
        let across = [0, 1, 2].map(|k| cross(units[(k + 1) % 3], units[(k + 2) % 3]));
        let volume = dot(units[0], across[0]);
        let steps = [STEP, STEP, if *motors == PLANAR { 0.0 } else { STEP }];
        [0, 1, 2].map(|i| [0, 1, 2].map(|k| steps[k] * across[k][i] / volume))
    }

    fn fixed(j: &Matrix) -> [[i32; 3]; 3] {
        j.map(|row| row.map(|v| (v * 64_000.0).round() as i32))
    }

    /// Returns by which part the change differs from the true one.
    fn missing(motors: &Matrix, ball: [f64; 3], turned: [i32; 3]) -> f64 {
        let before = jacobian(motors, ball);
        let moved = before.map(|row| dot(row, turned.map(f64::from)));
        let after = jacobian(motors, [0, 1, 2].map(|i| ball[i] + moved[i]));
        let change = bend(&fixed(&before), turned.map(|d| d * 16), *motors == PLANAR);
        let (mut off, mut all) = (0.0, 0.0);
        for (i, k) in (0..9).map(|at| (at / 3, at % 3)) {
            let exact = (after[i][k] - before[i][k]) * 64_000.0;
            off += (f64::from(change[i][k]) - exact).powi(2);
            all += exact * exact;
        }
        (off / all).sqrt()
    }

    #[test]
    fn it_is_the_change_on_a_rig_of_the_assumed_width() {
        for turned in [[10, 0, 0], [0, -12, 6], [8, 8, 8], [-9, 10, 4]] {
            let missing = missing(&SPATIAL, [870.0, 650.0, -600.0], turned);
            assert!(missing < 0.2, "{turned:?}: {missing} of it is missing");
        }
    }

    #[test]
    fn it_is_the_change_in_a_plane_of_the_assumed_width() {
        for turned in [[10, 0, 0], [0, -12, 0], [8, 8, 0], [-9, 10, 0]] {
            let missing = missing(&PLANAR, [0.0, 650.0, -600.0], turned);
            assert!(missing < 0.2, "{turned:?}: {missing} of it is missing");
        }
    }

    /// Returns where a ball hangs on two rigid cables of these lengths, mm.
    fn hang([a, b]: [f64; 2]) -> [f64; 3] {
        let width = PLANAR[0][1];
        let y = (width * width + b * b - a * a) / (2.0 * width);
        [0.0, y, -(b * b - y * y).sqrt()]
    }

    /// A drive from one side to the other, with noise in all axes.
    #[test]
    fn in_a_plane_the_third_motor_rests_and_has_no_part_in_j() {
        let (start, mut motors) = ([900.0, 800.0], [0; 3]);
        let mut measurement = Measurement {
            ball: [0; 3],
            variances: [1_000_000; 3],
            motors,
            motors_before: [[0; 3]; 2],
            motors_ahead: [0; 3],
            target: [0, 300_000, -800_000],
            velocity: [0; 3],
        };
        let mut estimate = None;
        let mut left = i32::MAX;
        for frame in 0..150 {
            let cable = |k: usize| start[k] + STEP * f64::from(motors[k]) / 16.0;
            let noise = |i: i32| (frame * (i + 3) % 5 - 2) * 500;
            let ball = hang([0, 1].map(cable)).map(|mm| (mm * 1e3) as i32);
            measurement.ball = [0, 1, 2].map(|i| ball[i] + noise(i as i32));
            (measurement.motors, measurement.motors_ahead) = (motors, motors);
            let estimate = estimate.get_or_insert_with(|| Estimate::new(&measurement, true, None));
            estimate.update(&measurement);
            let j = estimate.projected();
            assert_eq!((j[0], j.map(|row| row[2])), ([0; 3], [0; 3]), "frame {frame}");
            let n = estimate.cautious_steps(&j, estimate.predicted_error(&j, &measurement));
            // Q8 to Q4, a third of the way, 13 steps at most.
            let n = n.unwrap().map(|n| (n / 48).clamp(-208, 208));
            motors = [0, 1, 2].map(|k| motors[k] + n[k]);
            assert_eq!(motors[2], 0, "frame {frame}");
            left = (ball[1] - 300_000).abs() + (ball[2] + 800_000).abs();
        }
        assert!(left < 3_000, "the ball is {left} µm away");
    }

    #[test]
    fn it_is_bounded_and_none_for_motors_that_rest() {
        let largest = (1 << 19) - 1;
        for j in [[[0; 3]; 3], [[largest; 3]; 3], [[1, -1, largest], [0; 3], [-largest; 3]]] {
            assert_eq!(bend(&j, [0; 3], false), [[0; 3]; 3]);
            for turned in [i32::MAX, i32::MIN] {
                let changes = bend(&j, [turned, -1, turned], false);
                assert!(changes.iter().flatten().all(|c| c.abs() <= 1 << 20), "{changes:?}");
            }
        }
    }
}
