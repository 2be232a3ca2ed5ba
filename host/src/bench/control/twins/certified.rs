//! Kalman filters for p and J, Gauss-Newton or a cautious step where descent is certain, the law of signs elsewhere.

use nalgebra::{Matrix3, RowVector3, Vector3};
use plumb_core::law::{Demand, Law, Picture};
use plumb_protocol::config::SIGNS;

use super::super::limits::Limits;
use super::sign::direction;
use super::{Seen, along, demand};

/// First guess of |J|, mm/step, and its variance in parts of its square: common to a row, and each entry's own.
const GUESS: [[f64; 3]; 3] = [[0.27, 0.27, 0.54], [0.51, 0.51, 0.0], [0.33, 0.33, 0.33]];
const COMMON: f64 = 77.0 / 256.0;
const OWN: [f64; 3] = [102.0 / 256.0, 26.0 / 256.0, 102.0 / 256.0];
/// What J_yC may be, mm/step.
const ASKEW: f64 = 0.090;
/// σ of measurements, mm.
const SIGMA: [f64; 3] = [2.0, 1.0, 1.0];
/// Nothing is certified within this distance, mm.
const NEAR: f64 = 10.0;
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
    }

    /// Takes in a measurement, mm; what is farther off than 4 standard deviations counts as so far off.
    fn measured(&mut self, z: f64) {
        let s = self.p_pp + self.variance;
        let most = 4.0 * s.sqrt();
        let innovation = (z - self.p).clamp(-most, most);
        let (k_p, k_j) = (self.p_pp / s, self.p_pj / s);
        self.p += k_p * innovation;
        self.j += k_j * innovation;
        self.p_jj -= k_j * self.p_pj.transpose();
        self.p_pj *= 1.0 - k_p;
        self.p_pp *= 1.0 - k_p;
    }
}

/// The estimate and the motors' limits.
pub(super) struct Certified {
    limits: Limits,
    /// The axes, and where the motors were for them.
    estimate: Option<([Axis; 3], Vector3<f64>)>,
}

impl Certified {
    pub(super) fn new(limits: Limits) -> Self {
        Self { limits, estimate: None }
    }

    /// The law of signs at full speed until close to the target, for e = target - ball.
    fn by_signs(&self, e: &Vector3<f64>) -> Vector3<f64> {
        let w = direction(&-e);
        let largest = w.amax();
        if largest > 0.0 { w * (self.limits.rate * (e.norm() / SIGN_SLOWS).min(1.0) / largest) } else { w }
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

/// Whether `n` steps make |e| fall for every J within three standard deviations.
fn certain(axes: &[Axis; 3], j: &Matrix3<f64>, e: &Vector3<f64>, n: &Vector3<f64>) -> bool {
    let doubt: f64 = (0..3).map(|i| e[i].powi(2) * n.dot(&(axes[i].p_jj * n))).sum();
    3.0 * doubt.max(0.0).sqrt() < e.dot(&(j * n))
}

/// Gauss-Newton where that is certain; elsewhere the steps that make E|e - J n|² the least, where those are, or near the target.
fn steps(axes: &[Axis; 3], j: &Matrix3<f64>, e: &Vector3<f64>) -> Option<Vector3<f64>> {
    let certain = |n: &Vector3<f64>| certain(axes, j, e, n);
    let newton = j.try_inverse().filter(|_| j.determinant() > 0.0).map(|inverse| inverse * e);
    newton.filter(certain).or_else(|| {
        let unknown = axes.iter().fold(Matrix3::zeros(), |sum, axis| sum + axis.p_jj);
        let cautious = (j.transpose() * j + unknown).try_inverse()? * (j.transpose() * e);
        Some(cautious).filter(|n| e.norm() < NEAR || certain(n))
    })
}

impl Law for Certified {
    fn update(&mut self, picture: &Picture) -> Demand {
        let seen = Seen::from(picture);
        match &mut self.estimate {
            Some((axes, motors)) => {
                let d = seen.then - *motors;
                for (axis, z) in axes.iter_mut().zip(&seen.ball) {
                    axis.turned(&d);
                    axis.measured(*z);
                }
                *motors = seen.then;
            }
            none => *none = Some(([0, 1, 2].map(|i| Axis::new(i, seen.ball[i])), seen.then)),
        }
        let Some((axes, motors)) = &self.estimate else { return Demand::default() };
        let j = projected(axes);
        let p = Vector3::new(axes[0].p, axes[1].p, axes[2].p);
        let e = seen.target - (p + j * (seen.ahead - motors));
        let steps = steps(axes, &j, &e);
        demand(steps.map_or_else(|| self.by_signs(&e), |n| along(n, &self.limits)))
    }
}
