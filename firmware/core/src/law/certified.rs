//! The law that estimates J while driving, and uses it where descent is certain.

use super::axis::{Axis, times};
use super::sign;
use super::solve::solve;
use super::{Demand, Law, Limits, MotorRates, Picture};

/// Σ, pattern (12).
pub(super) const SIGNS: [[i32; 3]; 3] = [[-1, -1, 1], [-1, 1, 0], [-1, -1, -1]];

/// The first guess of |J|, µm/step: less than most entries of a large rig, more than most of a small one. Of 130 to 330 it
/// has the shortest tails on docs/control.md's population.
const GUESS: i32 = 300;
/// What J_yC, which is zero on a level rig, may be instead: 0.3 of that.
const ASKEW: i32 = 90;
/// Below this distance nothing is certified: noise is as large, and the estimate is good by then. µm.
const NEAR: i64 = 10_000;
/// The law of signs slows down from here, µm.
const SIGN_SLOWS: i64 = 65_000;

/// Kalman filters for p and J; Gauss-Newton on them where it makes |e| fall for every J within three standard
/// deviations, the law of signs elsewhere. Both make V = |e|² fall, so that going from one to the other needs no wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Certified {
    limits: Limits,
    estimate: Option<Estimate>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Estimate {
    axes: [Axis; 3],
    /// Where the motors were for it, Q4 steps.
    motors: [i32; 3],
}

impl Estimate {
    fn new(picture: &Picture) -> Self {
        let axis = |i: usize| {
            let zero = |k: usize| SIGNS[i][k] == 0;
            let row = [0, 1, 2].map(|k| (SIGNS[i][k] * GUESS) << 6);
            let sd = [0, 1, 2].map(|k| if zero(k) { ASKEW } else { GUESS });
            // 0.09 of the others' noise.
            let noise = [0, 1, 2].map(|k| if zero(k) { 23 } else { 256 });
            Axis::new(picture.ball[i], row, sd, picture.variances[i], noise)
        };
        Self { axes: [axis(0), axis(1), axis(2)], motors: picture.then }
    }

    fn update(&mut self, picture: &Picture) {
        let turned = [0, 1, 2].map(|k| picture.then[k].saturating_sub(self.motors[k]));
        self.motors = picture.then;
        for (i, axis) in self.axes.iter_mut().enumerate() {
            axis.turned(turned);
            axis.measured(picture.ball[i], picture.variances[i]);
        }
    }

    /// J, every entry of Σ's sign and at least a hundredth of the largest: then it can be inverted (Proposition 1).
    fn projected(&self) -> [[i32; 3]; 3] {
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
    fn ahead(&self, j: &[[i32; 3]; 3], picture: &Picture) -> [i32; 3] {
        let due = [0, 1, 2].map(|k| i64::from(picture.ahead[k].saturating_sub(self.motors[k])));
        [0, 1, 2].map(|i| {
            // Bits: J 19, steps in Q4 at most 26; Q10 to Q4.
            let moves: i64 = (0..3).map(|k| times(j[i][k].into(), due[k])).sum::<i64>() >> 6;
            let ball = (i64::from(self.axes[i].p) + moves) >> 4;
            (i64::from(picture.target[i]) - ball).clamp(-(1 << 23), 1 << 23) as i32
        })
    }

    /// Whether `n` (steps, Q8) makes |e| fall for every J within three standard deviations. e'J n is |e|² for the
    /// estimate, and its standard deviation is the root of Σ (e_i sd(J_i n))²: three of them are
    /// less than that.
    fn certain(&self, e: [i32; 3], n: [i32; 3]) -> bool {
        let longest = n.iter().map(|n| 32 - n.unsigned_abs().leading_zeros()).max().unwrap_or(0);
        let fewer = longest.saturating_sub(13);
        let n = n.map(|n| n >> fewer);
        // Bits: e 23, sd 24. n is in Q8, `fewer` bits short.
        let doubts = [0, 1, 2].map(|i| {
            let sd = self.axes[i].sd_of(n);
            let sd = if fewer >= 8 { sd << (fewer - 8) } else { sd >> (8 - fewer) };
            times(e[i].abs().into(), sd.min(1 << 24))
        });
        let square: i64 = e.iter().map(|e| times((*e).into(), (*e).into())).sum();
        3 * length(doubts) < square
    }
}

/// The root of the sum of squares of three numbers of up to 47 bits, to 23 of them.
fn length(v: [i64; 3]) -> i64 {
    let longest = v.iter().map(|v| 64 - v.unsigned_abs().leading_zeros()).max().unwrap_or(0);
    let fewer = longest.saturating_sub(23);
    let squares: u64 = v.iter().map(|v| (v >> fewer).unsigned_abs().pow(2)).sum();
    (squares.isqrt() as i64) << fewer
}

impl Certified {
    /// The law for motors of these limits.
    pub(crate) fn new(limits: Limits) -> Self {
        Self { limits, estimate: None }
    }

    /// Rates along `n` (Q8 steps still to go): 8/s of the longest way, less where the motors could not brake in time.
    fn along(&self, n: [i32; 3]) -> MotorRates {
        let longest = n.iter().map(|n| i64::from(n.abs())).max().unwrap_or(0).max(1);
        // sqrt(1.2 a m) in Q8, bits: 22 + 1 + 22 + 8.
        let braking = i64::from(self.limits.acceleration) * 6 / 5 * longest.min(1 << 22) * 256;
        let braking = braking.unsigned_abs().isqrt() as i64;
        let rate = (8 * longest).min(braking).min(i64::from(self.limits.rate));
        // Bits: 26 + 31 is no more than the ratio's 31 after the division.
        MotorRates(n.map(|n| (i64::from(n) * rate / longest) as i32))
    }

    /// The law of signs at full speed until close to the target.
    fn by_signs(&self, e: [i32; 3]) -> MotorRates {
        let w = sign::direction(e.map(|e| -e)).map(i64::from);
        let largest = w.iter().map(|w| w.abs()).max().unwrap_or(0).max(1);
        let square: i64 = e.iter().map(|e| times((*e).into(), (*e).into())).sum();
        let distance = (square.unsigned_abs().isqrt() as i64).min(SIGN_SLOWS);
        // Bits: rate 31 + distance 16 = 47.
        let rate = i64::from(self.limits.rate) * distance / SIGN_SLOWS;
        MotorRates(w.map(|w| (w * rate / largest) as i32))
    }
}

impl Law for Certified {
    fn update(&mut self, picture: &Picture) -> Demand {
        let estimate = match &mut self.estimate {
            Some(estimate) => {
                estimate.update(picture);
                *estimate
            }
            none => *none.insert(Estimate::new(picture)),
        };
        let j = estimate.projected();
        let e = estimate.ahead(&j, picture);
        let near = e.iter().map(|e| times((*e).into(), (*e).into())).sum::<i64>() < NEAR * NEAR;
        let step = solve(&j, e).filter(|n| near || estimate.certain(e, *n));
        Demand::at_once(step.map_or_else(|| self.by_signs(e), |n| self.along(n)))
    }
}
