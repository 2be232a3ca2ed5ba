//! The law `adaptive`: Kalman filters for p and J, a cautious step where descent is certain enough,
//! and the law `sign` elsewhere.

use nalgebra::{Matrix3, RowVector3, Vector3};
use plumb_core::law::{Law, Measurement, Setpoint};
use plumb_protocol::config::SIGNS;
use plumb_protocol::{AXES, PerAxis, PerMotor};
use plumb_sim::limits::RigLimits;

use super::sign::direction;
use crate::control::float::{FloatMeasurement, setpoint};

/// Initial |J|, mm/step.
const INITIAL_J: PerAxis<PerMotor<f64>> =
    [[0.27, 0.27, 0.54], [0.51, 0.51, 0.0], [0.33, 0.33, 0.33]];
/// Initial variance common to a row of J, relative to the square of its entries.
const ROW_VARIANCE: f64 = 77.0 / 256.0;
/// Initial variance of each entry, relative to its square, by row.
const ENTRY_VARIANCE: PerAxis<f64> = [102.0 / 256.0, 26.0 / 256.0, 102.0 / 256.0];
/// Standard deviation of the entry J_yC, which is 0 in a symmetric rig, mm/step.
const ZERO_ENTRY_SD: f64 = 0.090;
/// Noise of J_yC, relative to the variance of the other entries' noise.
const ZERO_ENTRY_NOISE: f64 = 23.0 / 256.0;
/// Standard deviation of measurements along x, y, z, mm.
const MEASUREMENT_SD: PerAxis<f64> = [2.0, 1.0, 1.0];
/// Standard deviation of disturbances of the ball between two frames, mm.
const DISTURBANCE_SD: f64 = 0.05;
/// Standard deviation of a motion's effect, as a fraction of it.
const MOTION_SD: f64 = 0.02;
/// Standard deviation of J's drift for the square root of a step, as a fraction of its largest
/// entry.
const DRIFT_SD: f64 = 0.01;
/// Innovations beyond this many standard deviations are clamped.
const MAX_INNOVATION_SDS: f64 = 4.0;
/// Greatest ratio of standard deviation to mean of e'J n for a step n.
const MAX_UNCERTAINTY: f64 = 1.0 / 3.0;
/// Braking margin of a step, in squares of that ratio.
const MARGIN_GAIN: f64 = 7.0;
/// Greatest braking margin, as a fraction of the way.
const MAX_MARGIN: f64 = 0.75;
/// Greatest braking margin, steps.
const MAX_MARGIN_STEPS: f64 = 40.0;
/// Rate for a remaining step, 1/s.
const PROPORTIONAL_GAIN: f64 = 9.0;
/// Factor in the rate sqrt(1.25 a n) from which a motor brakes within n steps.
const BRAKING_FACTOR: f64 = 1.25;
/// Least validity of a setpoint, seconds.
const MIN_VALID_S: f64 = 0.035;
/// Distance from the target below which the ball is held, mm.
const HOLD_DISTANCE: f64 = 3.0;
/// The nth consecutive frame of a held ball has 1 + n/4 times the measurement's variance.
const HOLD_VARIANCE_FRAMES: f64 = 4.0;
/// Greatest such n.
const MAX_HOLD_FRAMES: u32 = 28;
/// Motion of the ball along z after which row z of J may have another scale, mm.
const SCALE_DISTANCE: f64 = 102.4;
/// Greatest such change of scale between two frames, as a fraction.
const MAX_SCALE_CHANGE: f64 = 0.5;
/// Least error that counts as an overshoot, mm. Smaller errors are noise.
const MIN_OVERSHOOT: f64 = 7.0;
/// Number of overshoots without an effect.
const FREE_OVERSHOOTS: u32 = 1;
/// Factor of the rates after each further overshoot.
const OVERSHOOT_DAMPING: f64 = 0.75;
/// Least factor of the rates after overshoots.
const MIN_GAIN_SCALE: f64 = 0.1;
/// Distance from the target below which the law `sign` slows down, mm.
const SIGN_SLOWDOWN: f64 = 65.0;

/// Kalman filter of one coordinate of the ball and its row of J.
struct AxisKalman {
    /// Estimated coordinate, mm.
    p: f64,
    /// Estimated row of J, mm/step.
    j: Vector3<f64>,
    /// Covariance of the row of J.
    p_jj: Matrix3<f64>,
    /// Covariance of coordinate and row of J.
    p_pj: Vector3<f64>,
    /// Variance of the coordinate.
    p_pp: f64,
    /// Variance of a measurement, mm².
    variance: f64,
    /// Noise of each entry of J, relative to the row's.
    noise: Vector3<f64>,
    /// Whether the scale of the row changes with the coordinate.
    scales: bool,
}

impl AxisKalman {
    /// Creates the filter of coordinate `i` from its first measurement `p`, mm.
    fn new(i: usize, p: f64) -> Self {
        let signs = Vector3::from(SIGNS[i].map(f64::from));
        let zeros = signs.map(|s: f64| 1.0 - s.abs());
        let j = signs.component_mul(&Vector3::from(INITIAL_J[i]));
        let own = j.component_mul(&j) * ENTRY_VARIANCE[i] + zeros * ZERO_ENTRY_SD.powi(2);
        let variance = MEASUREMENT_SD[i].powi(2);
        Self {
            p,
            j,
            p_jj: j * j.transpose() * ROW_VARIANCE + Matrix3::from_diagonal(&own),
            p_pj: Vector3::zeros(),
            p_pp: variance,
            variance,
            noise: zeros * ZERO_ENTRY_NOISE + signs.map(f64::abs),
            scales: i == 2,
        }
    }

    /// Predicts the state after a motion of the motors by `d` steps.
    fn predict(&mut self, d: &Vector3<f64>) {
        let moved = self.j.dot(d);
        let spread = self.p_jj * d;
        self.p += moved;
        self.p_pp += d.dot(&(2.0 * self.p_pj + spread))
            + (MOTION_SD * moved).powi(2)
            + DISTURBANCE_SD.powi(2);
        self.p_pj += spread;
        let growth = (DRIFT_SD * self.j.amax()).powi(2) * d.lp_norm(1);
        self.p_jj += Matrix3::from_diagonal(&(self.noise * growth));
        if self.scales {
            self.p_jj += self.j
                * self.j.transpose()
                * (moved / SCALE_DISTANCE).abs().min(MAX_SCALE_CHANGE).powi(2);
        }
    }

    /// Updates the state with a measurement `z`, mm, after `held` consecutive frames of a held
    /// ball. The innovation is clamped. Frames of a held ball do not change J.
    fn update(&mut self, z: f64, held: u32) {
        let s = self.p_pp + self.variance * (1.0 + f64::from(held) / HOLD_VARIANCE_FRAMES);
        let most = MAX_INNOVATION_SDS * s.sqrt();
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

/// State of the law.
pub(super) struct Adaptive {
    limits: RigLimits,
    /// Filters, and the motor positions of their estimate, steps.
    estimate: Option<(PerAxis<AxisKalman>, Vector3<f64>)>,
    overshoots: OvershootDetector,
    /// Number of consecutive frames of a held ball.
    held: u32,
}

/// Counter of overshoots during a drive to a target.
#[derive(Default)]
struct OvershootDetector {
    target: Vector3<f64>,
    /// Error at the last sign change outside the noise, mm.
    side: Vector3<f64>,
    count: u32,
}

impl OvershootDetector {
    /// Updates the counter with error `e`, mm. Returns the factor of the rates.
    fn gain_scale(&mut self, target: Vector3<f64>, e: &Vector3<f64>) -> f64 {
        if self.target != target {
            *self = Self { target, ..Self::default() };
        }
        if e.norm() > MIN_OVERSHOOT {
            let along = e.dot(&self.side);
            self.count += u32::from(along < 0.0);
            if along <= 0.0 {
                self.side = *e;
            }
        }
        let counted = self.count.saturating_sub(FREE_OVERSHOOTS);
        OVERSHOOT_DAMPING.powi(counted as i32).max(MIN_GAIN_SCALE)
    }
}

impl Adaptive {
    /// Creates the law for motors of these limits.
    pub(super) fn new(limits: RigLimits) -> Self {
        Self { limits, estimate: None, overshoots: OvershootDetector::default(), held: 0 }
    }

    /// Returns the setpoint for `n` steps: rates proportional to the longest, limited by the rate
    /// from which a motor can brake within the steps less the `margin` (a fraction of them) and by
    /// the greatest rate, all times `gain_scale`. The setpoint is valid until the remaining steps
    /// are the braking distance.
    fn along(&self, n: Vector3<f64>, margin: f64, gain_scale: f64) -> Setpoint {
        let (longest, acceleration) = (n.amax().max(1e-9), self.limits.acceleration);
        let certain = longest - (longest * margin).min(MAX_MARGIN_STEPS);
        let braking = (BRAKING_FACTOR * acceleration * certain).sqrt();
        let rate = (PROPORTIONAL_GAIN * longest).min(braking).min(self.limits.rate) * gain_scale;
        let valid_s = longest / rate - rate / (2.0 * acceleration);
        Setpoint {
            valid_us: (valid_s.max(MIN_VALID_S) * 1e6) as u32,
            ..setpoint(n * (rate / longest))
        }
    }

    /// Returns the rates of the law `sign` for e = target - ball (mm): the greatest rate until
    /// close to the target.
    fn by_signs(&self, e: &Vector3<f64>) -> Vector3<f64> {
        let w = direction(&-e);
        let largest = w.amax();
        if largest > 0.0 {
            w * (self.limits.rate * (e.norm() / SIGN_SLOWDOWN).min(1.0) / largest)
        } else {
            w
        }
    }
}

/// Returns J with every entry projected to Σ's sign and at least a hundredth of the largest entry.
fn projected(axes: &PerAxis<AxisKalman>) -> Matrix3<f64> {
    let j = Matrix3::from_rows(&std::array::from_fn::<_, AXES, _>(|i| -> RowVector3<f64> {
        axes[i].j.transpose()
    }));
    let least = j.amax() / 100.0;
    Matrix3::from_fn(|i, k| match f64::from(SIGNS[i][k]) {
        0.0 => j[(i, k)],
        sign => sign * (sign * j[(i, k)]).max(least),
    })
}

/// Returns the ratio of standard deviation to mean of e'J n; `None` if the mean is not positive.
fn uncertainty(
    axes: &PerAxis<AxisKalman>,
    j: &Matrix3<f64>,
    e: &Vector3<f64>,
    n: &Vector3<f64>,
) -> Option<f64> {
    let variance: f64 = (0..AXES).map(|i| e[i].powi(2) * n.dot(&(axes[i].p_jj * n))).sum();
    let mean = e.dot(&(j * n));
    (mean > 0.0).then(|| variance.max(0.0).sqrt() / mean)
}

/// Returns the steps n that minimise E|e - J n|² and the braking margin as a fraction of them;
/// `None` if descent is not certain enough.
fn steps(
    axes: &PerAxis<AxisKalman>,
    j: &Matrix3<f64>,
    e: &Vector3<f64>,
) -> Option<(Vector3<f64>, f64)> {
    let covariance = axes.iter().fold(Matrix3::zeros(), |sum, axis| sum + axis.p_jj);
    let n = (j.transpose() * j + covariance).try_inverse()? * (j.transpose() * e);
    let ratio = uncertainty(axes, j, e, &n).filter(|ratio| *ratio < MAX_UNCERTAINTY)?;
    Some((n, (MARGIN_GAIN * ratio.powi(2)).min(MAX_MARGIN)))
}

impl Law for Adaptive {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let measurement = FloatMeasurement::from(measurement);
        match &mut self.estimate {
            Some((axes, motors)) => {
                let d = measurement.motors - *motors;
                let holds = (Vector3::from(std::array::from_fn::<_, AXES, _>(|i| axes[i].p))
                    - measurement.target)
                    .norm()
                    < HOLD_DISTANCE;
                self.held = if holds { (self.held + 1).min(MAX_HOLD_FRAMES) } else { 0 };
                for (axis, z) in axes.iter_mut().zip(&measurement.ball) {
                    axis.predict(&d);
                    axis.update(*z, self.held);
                }
                *motors = measurement.motors;
            }
            none => {
                *none = Some((
                    std::array::from_fn(|i| AxisKalman::new(i, measurement.ball[i])),
                    measurement.motors,
                ))
            }
        }
        let Some((axes, motors)) = &self.estimate else { return Setpoint::default() };
        let j = projected(axes);
        let p = Vector3::new(axes[0].p, axes[1].p, axes[2].p);
        let e = measurement.target - (p + j * (measurement.motors_ahead - motors));
        let gain_scale = self.overshoots.gain_scale(measurement.target, &e);
        let steps = steps(axes, &j, &e);
        steps.map_or_else(
            || setpoint(self.by_signs(&e)),
            |(n, margin)| self.along(n, margin, gain_scale),
        )
    }
}
