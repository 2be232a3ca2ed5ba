//! Kalman filters for p and J, a cautious step where descent is certain enough, the law of signs
//! elsewhere.

use nalgebra::{Matrix3, RowVector3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_protocol::config::SIGNS;

use super::sign::direction;
use super::{Seen, setpoint};
use plumb_sim::limits::Limits;

/// First guess of |J|, mm/step, and its variance in parts of its square: common to a row, and each
/// entry's own.
const GUESS: [[f64; 3]; 3] = [[0.27, 0.27, 0.54], [0.51, 0.51, 0.0], [0.33, 0.33, 0.33]];
const COMMON: f64 = 77.0 / 256.0;
const OWN: [f64; 3] = [102.0 / 256.0, 26.0 / 256.0, 102.0 / 256.0];
/// What J_yC may be, mm/step.
const ASKEW: f64 = 0.090;
/// σ of measurements, mm.
const SIGMA: [f64; 3] = [2.0, 1.0, 1.0];
/// A step is not certain enough from this standard deviation of e'J n over its mean on.
const DOUBTFUL: f64 = 1.0 / 3.0;
/// Of the way, this times its square is not what the motors brake on; so much of it at most, and so
/// many steps.
const SOONER: f64 = 7.0;
const SOONER_MOST: (f64, f64) = (0.75, 40.0);
/// No setpoint lasts for less, seconds.
const LASTS_S: f64 = 0.035;
/// Nearer than this the ball is held, mm; an nth such picture in a row has 1 + n/4 times its
/// variance, up to n = 28.
const HELD: f64 = 3.0;
const HELD_GROWS: f64 = 4.0;
const HELD_MOST: u32 = 28;
/// A row of J that scales may be all different after this way along its axis, mm, and at most this
/// part of it for a picture's.
const SCALES: f64 = 102.4;
const SCALES_MOST: f64 = 0.5;
/// Going past the target by less is noise, mm; so many times are free; what is left of the rates
/// after each more, and at least.
const PAST: f64 = 7.0;
const FREE: u32 = 1;
const CUT: f64 = 0.75;
const CALMEST: f64 = 0.1;
/// The law of signs slows down from here, mm.
const SIGN_SLOWS: f64 = 65.0;
/// What moves the ball besides the motors, mm a picture.
const WANDER: f64 = 0.05;
/// Noise of J_yC, of the others' variance.
const ASKEW_NOISE: f64 = 23.0 / 256.0;

/// One coordinate of the ball, and the row of J that moves it.
struct Axis {
    p: f64,
    j: Vector3<f64>,
    p_jj: Matrix3<f64>,
    p_pj: Vector3<f64>,
    p_pp: f64,
    variance: f64,
    /// Of the growth of P_JJ, each entry's part.
    noise: Vector3<f64>,
    scales: bool,
}

impl Axis {
    fn new(i: usize, p: f64) -> Self {
        let signs = Vector3::from(SIGNS[i].map(f64::from));
        let zeros = signs.map(|s: f64| 1.0 - s.abs());
        let j = signs.component_mul(&Vector3::from(GUESS[i]));
        let own = j.component_mul(&j) * OWN[i] + zeros * ASKEW.powi(2);
        let variance = SIGMA[i].powi(2);
        Self {
            p,
            j,
            p_jj: j * j.transpose() * COMMON + Matrix3::from_diagonal(&own),
            p_pj: Vector3::zeros(),
            p_pp: variance,
            variance,
            noise: zeros * ASKEW_NOISE + signs.map(f64::abs),
            scales: i == 2,
        }
    }

    /// The motors turned by `d` steps.
    fn turned(&mut self, d: &Vector3<f64>) {
        let moved = self.j.dot(d);
        let spread = self.p_jj * d;
        self.p += moved;
        self.p_pp += d.dot(&(2.0 * self.p_pj + spread)) + (0.02 * moved).powi(2) + WANDER.powi(2);
        self.p_pj += spread;
        let growth = (0.01 * self.j.amax()).powi(2) * d.lp_norm(1);
        self.p_jj += Matrix3::from_diagonal(&(self.noise * growth));
        if self.scales {
            self.p_jj +=
                self.j * self.j.transpose() * (moved / SCALES).abs().min(SCALES_MOST).powi(2);
        }
    }

    /// Takes in a measurement, mm; what is farther off than 4 standard deviations counts as so far
    /// off. Of a ball that is held, as in so many pictures before, it says nothing of J.
    fn measured(&mut self, z: f64, held: u32) {
        let s = self.p_pp + self.variance * (1.0 + f64::from(held) / HELD_GROWS);
        let most = 4.0 * s.sqrt();
        let innovation = (z - self.p).clamp(-most, most);
        let (k_p, k_j) = (self.p_pp / s, self.p_pj / s);
        self.p += k_p * innovation;
        if held == 0 {
            self.j += k_j * innovation;
            self.p_jj -= k_j * self.p_pj.transpose();
        }
        self.p_pj *= 1.0 - k_p;
        self.p_pp *= 1.0 - k_p;
    }
}

/// The estimate and the motors' limits.
pub(super) struct Adaptive {
    limits: Limits,
    /// The axes, and where the motors were for them.
    estimate: Option<([Axis; 3], Vector3<f64>)>,
    swings: Swings,
    /// Pictures in a row of a ball that is held.
    held: u32,
}

/// How often the ball went past its target.
#[derive(Default)]
struct Swings {
    target: Vector3<f64>,
    /// The error on the side that the ball was on last, mm.
    side: Vector3<f64>,
    passed: u32,
}

impl Swings {
    /// What is left of the rates.
    fn calm(&mut self, target: Vector3<f64>, e: &Vector3<f64>) -> f64 {
        if self.target != target {
            *self = Self { target, ..Self::default() };
        }
        if e.norm() > PAST {
            let along = e.dot(&self.side);
            self.passed += u32::from(along < 0.0);
            if along <= 0.0 {
                self.side = *e;
            }
        }
        CUT.powi(self.passed.saturating_sub(FREE) as i32).max(CALMEST)
    }
}

impl Adaptive {
    pub(super) fn new(limits: Limits) -> Self {
        Self { limits, estimate: None, swings: Swings::default(), held: 0 }
    }

    /// Along `n` steps: 9/s of the longest way, no faster than the motor may brake from on what is
    /// sure of it, or turn; of these rates a part. They hold until what is left of the way is what
    /// the motors brake on.
    fn along(&self, n: Vector3<f64>, unsure: f64, calm: f64) -> Setpoint {
        let (longest, acceleration) = (n.amax().max(1e-9), self.limits.acceleration);
        let sure = longest - (longest * unsure).min(SOONER_MOST.1);
        let braking = (1.25 * acceleration * sure).sqrt();
        let rate = (9.0 * longest).min(braking).min(self.limits.rate) * calm;
        let lasts_s = longest / rate - rate / (2.0 * acceleration);
        Setpoint { valid_us: (lasts_s.max(LASTS_S) * 1e6) as u32, ..setpoint(n * (rate / longest)) }
    }

    /// The law of signs at full speed until close to the target, for e = target - ball.
    fn by_signs(&self, e: &Vector3<f64>) -> Vector3<f64> {
        let w = direction(&-e);
        let largest = w.amax();
        if largest > 0.0 {
            w * (self.limits.rate * (e.norm() / SIGN_SLOWS).min(1.0) / largest)
        } else {
            w
        }
    }
}

/// J with every signed entry of Σ's sign and at least a hundredth of the largest.
fn projected(axes: &[Axis; 3]) -> Matrix3<f64> {
    let j = Matrix3::from_rows(&[0, 1, 2].map(|i| -> RowVector3<f64> { axes[i].j.transpose() }));
    let least = j.amax() / 100.0;
    Matrix3::from_fn(|i, k| match f64::from(SIGNS[i][k]) {
        0.0 => j[(i, k)],
        sign => sign * (sign * j[(i, k)]).max(least),
    })
}

/// The standard deviation of e'J n over its mean, where that is above zero.
fn doubt(axes: &[Axis; 3], j: &Matrix3<f64>, e: &Vector3<f64>, n: &Vector3<f64>) -> Option<f64> {
    let variance: f64 = (0..3).map(|i| e[i].powi(2) * n.dot(&(axes[i].p_jj * n))).sum();
    let mean = e.dot(&(j * n));
    (mean > 0.0).then(|| variance.max(0.0).sqrt() / mean)
}

/// The steps that make E|e - J n|² the least, where those are certain enough, and what of the way
/// is unsure.
fn steps(axes: &[Axis; 3], j: &Matrix3<f64>, e: &Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let unknown = axes.iter().fold(Matrix3::zeros(), |sum, axis| sum + axis.p_jj);
    let n = (j.transpose() * j + unknown).try_inverse()? * (j.transpose() * e);
    let doubt = doubt(axes, j, e, &n).filter(|doubt| *doubt < DOUBTFUL)?;
    Some((n, (SOONER * doubt.powi(2)).min(SOONER_MOST.0)))
}

impl Law for Adaptive {
    fn update(&mut self, picture: &Measurement) -> Setpoint {
        let seen = Seen::from(picture);
        match &mut self.estimate {
            Some((axes, motors)) => {
                let d = seen.then - *motors;
                let holds =
                    (Vector3::from([0, 1, 2].map(|i| axes[i].p)) - seen.target).norm() < HELD;
                self.held = if holds { (self.held + 1).min(HELD_MOST) } else { 0 };
                for (axis, z) in axes.iter_mut().zip(&seen.ball) {
                    axis.turned(&d);
                    axis.measured(*z, self.held);
                }
                *motors = seen.then;
            }
            none => *none = Some(([0, 1, 2].map(|i| Axis::new(i, seen.ball[i])), seen.then)),
        }
        let Some((axes, motors)) = &self.estimate else { return Setpoint::default() };
        let j = projected(axes);
        let p = Vector3::new(axes[0].p, axes[1].p, axes[2].p);
        let e = seen.target - (p + j * (seen.ahead - motors));
        let calm = self.swings.calm(seen.target, &e);
        let steps = steps(axes, &j, &e);
        steps.map_or_else(|| setpoint(self.by_signs(&e)), |(n, unsure)| self.along(n, unsure, calm))
    }
}
