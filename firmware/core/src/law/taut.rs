//! The law `taut`: estimates the rig's geometry while driving, and keeps the cables taut. A monitor
//! of the progress damps a loop that swings, and detects filters that are stuck.
//!
//! The acceleration is limited by the uncertainty of the geometry. The law computes in f32. Sums,
//! products, quotients and square roots are the same everywhere (IEEE 754), and so are the results
//! of `libm`, so chip and emulation agree to the bit. Units: mm, motor steps, s.

mod filter;
mod geometry;
mod known_rig;
mod multi_model;
mod observation;
#[cfg(test)]
mod tests;

use plumb_protocol::units::RelativeTension;

use super::io::{Law, Measurement, MotorLimits, MotorRates, Setpoint};
use crate::timing::MAX_MEAN_MS;
use crate::vector::{per_axis, per_motor, plus};
use geometry::{Vector, along, dot, largest, length, scaled};
use multi_model::{GRAVITY, Mixture, MultiModelFilter};
use observation::{Observation, millimetres, steps};

pub use known_rig::KnownRig;

/// Time of a change of the rates, s: a frame time at 30 Hz.
const FRAME_S: f32 = 0.033;
/// Cables are taut while the sum of weight and inertia points into the motors' triangle. Two
/// standard deviations of the lateral acceleration shift the point where it meets the motors' plane
/// by at most this, mm.
const MAX_SHIFT_MM: f32 = 14.0;
/// Bound of the same two standard deviations, mm/s². At an edge of the population's triangles
/// there is room for 440 (1 % quantile).
const MAX_UNKNOWN: f32 = 400.0;
/// Acceleration that the motors may always have, steps/s².
const MIN_ACCELERATION: f32 = 250.0;
/// Share of the allowed acceleration that braking is planned with: the springs swing back by as
/// much again.
const BRAKING_SHARE: f32 = 0.5;
/// Rate over the steps that are left, 1/s.
const GAIN: f32 = 12.0;
/// Error below which the gain falls, mm. Below it lies the noise of the estimate, and the
/// microsteps of slow motors are in tune with a light ball on stiff cables.
const DEAD_ZONE_MM: f32 = 1.0;

/// Share of the highest rate that a path may ask for: the rest is for corrections.
const RATE_SHARE: f32 = 0.75;
/// Share of the allowed acceleration that a path may ask for.
const TURN_SHARE: f32 = 0.7;
/// Weight of a measurement in the mean change of the rates that a path asks for.
const TURN_WEIGHT: f32 = 0.2;

/// Way of the motors that is left to the target.
struct Way {
    /// Way of the ball, mm.
    e: Vector,
    /// Direction, with a largest entry of 1 or -1.
    unit: Vector,
    /// Largest entry of the way, steps.
    steps: f32,
    /// See [`Mixture::lateral_sigma`], along [`unit`](Self::unit).
    lateral_sigma: f32,
}

impl Way {
    /// Returns the way of the motors that moves the ball by `e` (mm); `None` where no motion does.
    fn new(mixture: &Mixture, e: Vector) -> Option<Self> {
        let way = mixture.steps(e)?;
        let steps = largest(way);
        let unit = scaled(way, 1.0 / steps.max(1e-9));
        Some(Self { e, unit, steps, lateral_sigma: mixture.lateral_sigma(unit) })
    }
}

/// A multi-model filter over the geometry, and a plan by its mixture.
#[derive(Debug, Clone, PartialEq)]
pub struct Taut {
    /// Limit of the rates, steps/s.
    max_rate: f32,
    /// Limit of the acceleration, steps/s².
    max_acceleration: f32,
    filter: Option<MultiModelFilter>,
    /// Rig with which the first filters begin.
    known: Option<KnownRig>,
    /// Rates of the last setpoint, steps/s.
    rates: Vector,
    /// Rates that the target's velocity asked for at the last measurement, steps/s.
    ahead: Vector,
    /// Mean change of these rates, steps/s².
    turn: Vector,
    progress: ProgressMonitor,
    /// Span of the moving average on the way to the target, ms.
    span_ms: u16,
    /// See [`Law::tensions`].
    tensions: Option<[RelativeTension; 3]>,
}

impl Taut {
    /// Creates the law for motors of these limits, with the rig that is `known`, if one is: a rig
    /// that is another is noticed, and told from the guesses.
    pub(crate) fn new(limits: MotorLimits, known: Option<KnownRig>) -> Self {
        Self {
            max_rate: limits.rate as f32 / 256.0,
            max_acceleration: limits.acceleration as f32,
            filter: None,
            known,
            rates: [0.0; 3],
            ahead: [0.0; 3],
            turn: [0.0; 3],
            progress: ProgressMonitor::new([f32::NAN; 3]),
            tensions: None,
            span_ms: MAX_MEAN_MS,
        }
    }

    /// Updates the filters, and returns their mixture.
    fn estimate(&mut self, seen: &Observation, target: Vector) -> Mixture {
        match &mut self.filter {
            Some(filter) => {
                filter.update(seen, target);
                filter.mixture(target)
            }
            none => {
                let filter = match self.known.take() {
                    Some(known) => MultiModelFilter::knowing(seen, target, &known),
                    None => MultiModelFilter::new(seen, target),
                };
                none.insert(filter).mixture(target)
            }
        }
    }

    /// Returns the allowed acceleration of the motors along `a` (largest entry 1), steps/s².
    fn acceleration(&self, mixture: &Mixture, a: Vector) -> f32 {
        self.acceleration_with(mixture, a, mixture.lateral_sigma(a))
    }

    /// Returns the [acceleration](Self::acceleration) along `a`, whose [lateral standard
    /// deviation](Mixture::lateral_sigma) is known.
    #[inline(never)]
    fn acceleration_with(&self, mixture: &Mixture, a: Vector, lateral_sigma: f32) -> f32 {
        let unknown = (GRAVITY * MAX_SHIFT_MM / mixture.height.max(1.0)).min(MAX_UNKNOWN);
        let known = unknown / (2.0 * lateral_sigma + 1e-6);
        mixture.tension_factor(a).min(known).max(MIN_ACCELERATION).min(self.max_acceleration)
    }

    /// Returns the rates towards the target before their change is limited: along the straight line
    /// in motor space, as fast as the ball can be stopped on the steps that are left.
    fn wanted(
        &self,
        mixture: &Mixture,
        way: &Way,
        due: Vector,
        target: Vector,
        is_moving: bool,
    ) -> Vector {
        let left = mixture.steps_left(target, due, way.unit, way.steps);
        let pace = self.progress.pace();
        // The deviation is the same in both directions.
        let back = scaled(way.unit, -1.0);
        let allowed = self.acceleration_with(mixture, back, way.lateral_sigma);
        let braking = pace * BRAKING_SHARE * allowed;
        let dead_zone = if is_moving { 0.0 } else { DEAD_ZONE_MM * DEAD_ZONE_MM };
        let error = dot(way.e, way.e);
        let weight = error / (error + dead_zone).max(1e-9);
        let rate = (weight * pace * GAIN * left).min(libm::sqrtf(2.0 * braking * left));
        scaled(way.unit, rate.min(self.max_rate))
    }

    /// Returns the rates after a frame on the way from the last ones to `wanted`. Slowing down
    /// along the present direction and turning elsewhere are limited apart: of the present
    /// direction more is known.
    fn limited(&self, mixture: &Mixture, wanted: Vector) -> Vector {
        let last = self.rates;
        let kept = (dot(wanted, last) / dot(last, last).max(1e-9)).clamp(0.0, 1.0);
        let slower = self.in_a_frame(mixture, scaled(last, kept - 1.0));
        let other = self.in_a_frame(mixture, per_motor(|i| wanted[i] - kept * last[i]));
        per_motor(|i| last[i] + slower[i] + other[i])
    }

    /// Returns the part of a change of rates that the acceleration allows in a frame.
    #[inline(never)]
    fn in_a_frame(&self, mixture: &Mixture, change: Vector) -> Vector {
        let most = largest(change) / FRAME_S;
        if most < 1e-6 {
            return change;
        }
        let limit = self.acceleration(mixture, scaled(change, 1.0 / largest(change)));
        scaled(change, (limit / most).min(1.0))
    }
}

/// Acceleration of the motors for which the span of the moving average is chosen, steps/s².
const SPAN_ACCELERATION: f32 = 2000.0;
/// Span for a rig whose cables are far from slack, ms: the slowest period of a ball on cables of
/// 800 N/m is 130 to 270 ms (10 % and 90 % quantile).
const MIN_SPAN_MS: f32 = 200.0;
/// Span that is added for a [slack ratio](Mixture::slack_ratio) of one above [`FREE_RATIO`], ms.
const SPAN_PER_RATIO_MS: f32 = 2000.0;
/// Slack ratio up to which [`MIN_SPAN_MS`] is enough.
const FREE_RATIO: f32 = 0.7;
/// Standard deviations by which the geometry may be worse than its estimate.
const SPAN_SIGMAS: f32 = 12.0;

/// Span of the moving average.
impl Taut {
    /// Returns the span for a way, ms: long enough that a ball on soft cables does
    /// not swing where a swing makes a cable slack, and short elsewhere. A target that moves is
    /// followed with the configured span, since the reference is ahead by half of it.
    ///
    /// Rigs that become slack have a ratio above 1.5. Measured on 2 000 rigs a stiffness
    /// (docs/understand/method.md).
    fn span_ms(mixture: &Mixture, way: Option<&Way>, is_moving: bool) -> u16 {
        let Some(way) = way.filter(|_| !is_moving) else { return MAX_MEAN_MS };
        let ratio = mixture.slack_ratio(scaled(way.unit, SPAN_ACCELERATION));
        let moves = length(along(&mixture.j, way.unit)).max(1e-6);
        let doubt = SPAN_SIGMAS * way.lateral_sigma / moves;
        let beyond = (ratio * (1.0 + doubt) - FREE_RATIO).max(0.0);
        // The cast saturates.
        ((MIN_SPAN_MS + SPAN_PER_RATIO_MS * beyond) as u16).min(MAX_MEAN_MS)
    }

    /// Returns the span for a way, ms. On a rig that is known it only falls on the way to a target:
    /// a span that grows while the motors brake has the ball overshoot by a centimetre.
    fn span(&mut self, mixture: &Mixture, way: Option<&Way>, is_moving: bool) -> u16 {
        let span_ms = Self::span_ms(mixture, way, is_moving);
        let is_known = self.filter.as_ref().is_some_and(MultiModelFilter::is_known);
        self.span_ms = if is_known && !is_moving { span_ms.min(self.span_ms) } else { span_ms };
        self.span_ms
    }
}

/// Feed-forward.
impl Taut {
    /// Takes in the rates `ahead` that the target's velocity asks for (steps/s). Returns the
    /// [room](Setpoint::room) of the motors: of their rates, and of the acceleration that keeps the
    /// cables taut. On a bent path that grows with the square of the pace.
    fn room(&mut self, mixture: &Mixture, ahead: Vector) -> u16 {
        let change = scaled(plus(ahead, self.ahead, -1.0), 1.0 / FRAME_S);
        self.turn = plus(scaled(self.turn, 1.0 - TURN_WEIGHT), change, TURN_WEIGHT);
        self.ahead = ahead;
        let asked = largest(self.turn);
        let of_rates = largest(ahead).max(1e-3);
        let mut room = RATE_SHARE * self.max_rate / of_rates;
        if asked > 1.0 {
            let allowed = self.acceleration(mixture, scaled(self.turn, 1.0 / asked));
            room = room.min(libm::sqrtf(TURN_SHARE * allowed / asked));
        }
        // The cast saturates.
        if largest(ahead) > 0.0 { (room * 256.0) as u16 } else { 0 }
    }
}

impl Law for Taut {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let target = millimetres(measurement.target);
        let mixture = self.estimate(&Observation::new(measurement), target);
        // The cast saturates.
        self.tensions =
            Some(mixture.tensions_at_rest().map(|t| RelativeTension((t * 256.0 + 0.5) as u16)));
        let due = steps(measurement.motors, measurement.motors_ahead);
        let moves = along(&mixture.j, due);
        let e = per_axis(|i| target[i] - mixture.ball[i] - moves[i]);
        if measurement.is_moving() {
            self.progress.follow(target);
        }
        if self.progress.target != target {
            self.span_ms = MAX_MEAN_MS;
        }
        if self.progress.update(target, e) {
            self.filter = None;
        }
        let ahead = mixture.steps(millimetres(measurement.velocity)).unwrap_or_default();
        let (way, is_moving) = (Way::new(&mixture, e), measurement.is_moving());
        let wanted = match &way {
            Some(way) => self.wanted(&mixture, way, due, target, is_moving),
            None => [0.0; 3],
        };
        let wanted = plus(ahead, wanted, 1.0);
        self.rates = self.limited(&mixture, wanted);
        let rates = MotorRates(self.rates.map(|rate| (rate * 256.0) as i32));
        Setpoint {
            ramp_us: (FRAME_S * 1e6) as u32,
            span_ms: Some(self.span(&mixture, way.as_ref(), is_moving)),
            room: self.room(&mixture, ahead),
            ..Setpoint::at_once(rates)
        }
    }

    fn tensions(&self) -> Option<[RelativeTension; 3]> {
        self.tensions
    }
}

impl Taut {
    /// Returns the rig for the next run; `None` while the law knows too little of it.
    pub(super) fn known_rig(&self) -> Option<KnownRig> {
        self.filter.as_ref()?.known_rig()
    }
}

/// Least amplitude of a swing past the target, mm: above the noise of the estimate (below 1 for
/// measurements with 2, 1, 1 mm), and well below a radius of 10 mm.
const MIN_SWING_MM: f32 = 4.0;
/// Swings that do not reduce the pace.
const FREE_SWINGS: u8 = 1;
/// Factor on the pace at each further swing.
const DAMPING: f32 = 0.4;
/// Least pace. With a gain of 12/s times this, a loop without further delay is stable about a mode
/// of 0.6 Hz and ζ = 0.02: the gain is below 2 ζ ω.
const MIN_PACE: f32 = 0.012;
/// Measurements in a window whose mean error is judged. The mean: a ball that swings about its
/// target is not stuck.
const WINDOW: u8 = 45;
/// Least decrease of the mean error from window to window, mm; with less the filters are stuck.
const MIN_PROGRESS_MM: f32 = 3.0;
/// Mean error below which progress is not required, mm.
const NEAR_MM: f32 = 6.0;
/// Factor on the pace after a window without a swing, while the target is not near: the swinging is
/// over.
const RECOVERY: f32 = 2.0;

/// Factor on the pace with each measurement while the target moves: a swing is forgotten in 1.5 s.
const FOLLOWING_RECOVERY: f32 = 1.02;

/// Monitors the error on the way to one target.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ProgressMonitor {
    /// Target, mm.
    target: Vector,
    /// Largest error on the present side of the target, mm.
    side: Vector,
    /// Swings so far.
    swings: u8,
    /// Swings at the beginning of the window.
    swings_before: u8,
    pace: f32,
    /// Measurements in the window.
    count: u8,
    /// Sum of their errors, mm.
    sum: Vector,
    /// Length of the mean error of the last window, mm.
    mean_before: f32,
}

impl ProgressMonitor {
    /// Creates the monitor on the way to `target` (mm).
    fn new(target: Vector) -> Self {
        Self {
            target,
            side: [0.0; 3],
            swings: 0,
            swings_before: 0,
            pace: 1.0,
            count: 0,
            sum: [0.0; 3],
            mean_before: f32::MAX,
        }
    }

    /// Returns the factor on the gain, [`MIN_PACE`] to 1. It falls with each swing past the target:
    /// such a loop is too quick for what the filters do not model, and springs come to rest on a
    /// slower one. It rises again while a ball without swings is still on its way.
    fn pace(&self) -> f32 {
        self.pace
    }

    /// Goes on with a target that has moved to `target` (mm). Meanwhile the pace rises again.
    fn follow(&mut self, target: Vector) {
        self.target = target;
        self.pace = (FOLLOWING_RECOVERY * self.pace).min(1.0);
    }

    /// Takes the error (mm) on the way to `target`, and returns whether the filters are stuck.
    fn update(&mut self, target: Vector, e: Vector) -> bool {
        if target != self.target {
            *self = Self::new(target);
        }
        self.count_swings(e);
        self.count += 1;
        self.sum = per_axis(|i| self.sum[i] + e[i]);
        if self.count < WINDOW {
            return false;
        }
        let mean = length(scaled(self.sum, 1.0 / f32::from(WINDOW)));
        let stuck = mean > NEAR_MM && mean > self.mean_before - MIN_PROGRESS_MM;
        if mean > NEAR_MM && self.swings == self.swings_before {
            self.pace = (RECOVERY * self.pace).min(1.0);
        }
        self.swings_before = self.swings;
        (self.count, self.sum, self.mean_before) = (0, [0.0; 3], mean);
        stuck
    }

    fn count_swings(&mut self, e: Vector) {
        if dot(e, self.side) < 0.0 {
            if length(e) < MIN_SWING_MM {
                return;
            }
            self.side = e;
            self.swings = self.swings.saturating_add(1);
            if self.swings > FREE_SWINGS {
                self.pace = (DAMPING * self.pace).max(MIN_PACE);
            }
        } else if dot(e, e) > dot(self.side, self.side) {
            self.side = e;
        }
    }
}
