//! The law that estimates J while driving, and uses it where descent is certain.

use super::axis::{Axis, times};
use super::sign;
use super::solve::{J_BITS, excess, solve};
use super::{Demand, Law, Limits, MotorRates, Picture};

/// Σ, pattern (12).
pub(super) const SIGNS: [[i32; 3]; 3] = [[-1, -1, 1], [-1, 1, 0], [-1, -1, -1]];

/// The first guess of |J|, µm/step: a rig a metre wide with its ball half a metre below the motors and pulleys of 17 mm. In x
/// one cable works against two.
const GUESS: [[i32; 3]; 3] = [[270, 270, 540], [510, 510, 0], [330, 330, 330]];
/// Variance of that, in 1/256 of its square: of what a row's entries have in common, the pulleys' size for one, and of what each
/// has for itself. In y the two are nearly the same.
const COMMON: i32 = 77;
const OWN: [i32; 3] = [102, 26, 102];
/// What J_yC, which is zero on a level rig, may be instead, µm/step.
const ASKEW: i32 = 90;
/// Below this distance nothing is certified: noise is as large. µm.
const NEAR: i64 = 10_000;
/// The law of signs slows down from here, µm.
const SIGN_SLOWS: i64 = 65_000;

/// Kalman filters for p and J; Gauss-Newton on them where it makes |e| fall for every J within three standard deviations; a step
/// that minds what is unknown of J where that does; the law of signs elsewhere. All three make V = |e|² fall, so that
/// going from one to another needs no wait.
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
            Axis::new(picture.ball[i], row.map(|j| j << 6), p_jj, picture.variances[i], noise)
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

    /// The steps (Q8) to go, if there are any that are certain to lead nearer; close to the target certain or not.
    fn steps(&self, j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<[i32; 3]> {
        if let Some(n) = solve(j, e).filter(|n| self.certain(j, e, *n)) {
            return Some(n);
        }
        let near = square(e) < NEAR * NEAR;
        self.cautious(j, e).filter(|n| near || self.certain(j, e, *n))
    }

    /// The n (steps, Q8) that makes E|e - J n|² the least over what J may be: (Ĵ'Ĵ + Σ P_JJ) n = Ĵ'e. Where J is known it is
    /// Gauss-Newton's; where it is not, it turns motors little of which nobody knows what they do.
    fn cautious(&self, j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<[i32; 3]> {
        let few = excess(j.iter().flatten().copied(), J_BITS).max(0) as u32;
        let j = j.map(|row| row.map(|v| i64::from(v >> few)));
        // Bits: 14 + 14, 30 the sum; J is in Q6 less `few`, its square in Q12. P_JJ: 30, 32 the sum; Q8.
        let entry = |k: usize, l: usize| {
            let square: i64 = (0..3).map(|i| times(j[i][k], j[i][l])).sum();
            let unknown: i64 = self.axes.iter().map(|axis| i64::from(axis.p_jj[k][l])).sum();
            square + ((unknown << 4) >> (2 * few))
        };
        let (ab, ac, bc) = (entry(0, 1), entry(0, 2), entry(1, 2));
        let normal = [[entry(0, 0), ab, ac], [ab, entry(1, 1), bc], [ac, bc, entry(2, 2)]];
        // Bits: 14 + 23, 39 the sum; to Q6, as e is of a J in Q6.
        let right = [0, 1, 2].map(|k| (0..3).map(|i| times(j[i][k], e[i].into())).sum::<i64>() >> few);
        let bits = |v: &i64| 64 - v.unsigned_abs().leading_zeros();
        let longest = normal.iter().flatten().chain(&right).map(bits).max().unwrap_or(0);
        let fewer = longest.saturating_sub(31);
        solve(&normal.map(|row| row.map(|v| (v >> fewer) as i32)), right.map(|v| (v >> fewer) as i32))
    }

    /// Whether `n` (steps, Q8) makes |e| fall for every J within three standard deviations: e'J n has the variance
    /// Σ e_i² var(J_i n), and three roots of it are less than its mean.
    fn certain(&self, j: &[[i32; 3]; 3], e: [i32; 3], n: [i32; 3]) -> bool {
        // Neither the size of e nor that of n matters: 12 and 13 bits of them.
        let [e, n] = [(e, 12), (n, 13)].map(|(v, bits)| {
            let fewer = excess(v.into_iter(), bits).max(0);
            v.map(|v| v >> fewer)
        });
        let variances = [0, 1, 2].map(|i| self.axes[i].variance_of(n));
        let longest = variances.iter().map(|v| 64 - v.leading_zeros()).max().unwrap_or(0);
        // An even number of bits, of which the root has half.
        let half = longest.saturating_sub(23) / 2;
        // Bits: 24 + 24, 50 the sum.
        let doubt: i64 = (0..3)
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
        // Variances are in quarters. Bits: 25 + 14 + 1 and the 3.
        3 * ((doubt.unsigned_abs().isqrt() as i64) << (half + 1)) < falls
    }
}

/// |e|², µm².
fn square(e: [i32; 3]) -> i64 {
    e.iter().map(|e| times((*e).into(), (*e).into())).sum()
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
        let distance = (square(e).unsigned_abs().isqrt() as i64).min(SIGN_SLOWS);
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
        let steps = estimate.steps(&j, e);
        Demand::at_once(steps.map_or_else(|| self.by_signs(e), |n| self.along(n)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Picture = Picture {
        ball: [0; 3],
        variances: [4_000_000, 1_000_000, 1_000_000],
        then: [0; 3],
        ahead: [0; 3],
        target: [0; 3],
    };
    /// Q6 µm/step: a small rig's, a usual one's and a large one's near its motors.
    const JACOBIANS: [[[i32; 3]; 3]; 3] = [
        [[-2_000, -1_500, 5_000], [-5_000, 6_000, 100], [-2_500, -2_000, -3_000]],
        [[-17_000, -12_000, 30_000], [-35_000, 31_000, -900], [-18_000, -26_000, -14_000]],
        [[-50_000, -25_000, 90_000], [-80_000, 85_000, 0], [-60_000, -170_000, -200_000]],
    ];
    const ERRORS: [[i32; 3]; 3] =
        [[-9_000, 4_000, -3_000], [150_000, -60_000, 390_000], [1_200_000, 900_000, -700_000]];

    /// (J'J + `unknown`) n = J'e in floating point, by Cramer's rule.
    fn exact(j: &[[i32; 3]; 3], unknown: [[f64; 3]; 3], e: [i32; 3]) -> [f64; 3] {
        let j = j.map(|row| row.map(|v| f64::from(v) / 64.0));
        let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
        let m = [0, 1, 2].map(|k| [0, 1, 2].map(|l| unknown[k][l] + sum(&|i| j[i][k] * j[i][l])));
        let b = [0, 1, 2].map(|k| sum(&|i| j[i][k] * f64::from(e[i])));
        let det = |m: &[[f64; 3]; 3]| {
            sum(&|c| {
                m[0][c] * (m[1][(c + 1) % 3] * m[2][(c + 2) % 3] - m[1][(c + 2) % 3] * m[2][(c + 1) % 3])
            })
        };
        [0, 1, 2].map(|c| {
            let mut swapped = m;
            (0..3).for_each(|k| swapped[k][c] = b[k]);
            det(&swapped) / det(&m)
        })
    }

    /// How far `n` (Q8) is off, of the longest.
    fn off(n: [i32; 3], exact: [f64; 3]) -> f64 {
        let longest = exact.iter().fold(0.0, |most: f64, n| most.max(n.abs()));
        (0..3).map(|k| (f64::from(n[k]) / 256.0 - exact[k]).abs() / longest).fold(0.0, f64::max)
    }

    #[test]
    fn a_cautious_step_is_the_one_of_its_equation() {
        let estimate = Estimate::new(&PICTURE);
        let unknown = [0, 1, 2]
            .map(|k| [0, 1, 2].map(|l| estimate.axes.iter().map(|a| f64::from(a.p_jj[k][l]) / 256.0).sum()));
        for (j, e) in JACOBIANS.iter().flat_map(|j| ERRORS.map(|e| (j, e))) {
            let off = estimate.cautious(j, e).map(|n| off(n, exact(j, unknown, e)));
            assert!(off.is_some_and(|off| off < 0.01), "{j:?} {e:?}: {off:?}");
        }
    }

    #[test]
    fn what_is_known_for_sure_is_used_as_it_is_and_is_certain() {
        let mut estimate = Estimate::new(&PICTURE);
        estimate.axes.iter_mut().for_each(|axis| axis.p_jj = [[0; 3]; 3]);
        for (j, e) in JACOBIANS.iter().flat_map(|j| ERRORS.map(|e| (j, e))) {
            let (newton, cautious) = (solve(j, e), estimate.cautious(j, e));
            assert_eq!(estimate.steps(j, e), newton);
            let off = newton.zip(cautious).map(|(n, c)| off(c, n.map(|n| f64::from(n) / 256.0)));
            assert!(off.is_some_and(|off| off < 0.05), "{newton:?} {cautious:?}");
        }
    }

    #[test]
    fn nothing_is_certain_at_the_first_picture_but_near_the_target() {
        let estimate = Estimate::new(&PICTURE);
        let j = estimate.projected();
        assert_eq!(estimate.steps(&j, [100_000, 50_000, -80_000]), None);
        assert!(estimate.steps(&j, [5_000, -5_000, 3_000]).is_some());
    }
}
