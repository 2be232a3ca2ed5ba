//! Interface of a law: the [`Measurement`] that it gets, the [`Setpoint`] with its [`MotorRates`]
//! that it returns, and the [limits](MotorLimits) of the motors.

use plumb_protocol::config;
use plumb_protocol::dimension::{AXES, MOTORS, PerAxis, PerMotor};
use plumb_protocol::units::{Covariance, Point, RelativeTension};

use crate::vector::{per_axis, per_motor};
use crate::wide::{product, scale_by_ratio};

/// A control law with its state.
pub trait Law {
    /// Returns whether the law uses the target's velocity.
    fn uses_velocity(&self) -> bool {
        true
    }

    /// Takes in a measurement and returns what the motors are to do until the next one. The rates
    /// are not limited yet.
    fn update(&mut self, measurement: &Measurement) -> Setpoint;

    /// Returns the estimated tensions that hold the ball at rest at the last measurement. `None`
    /// before the first one, and for a law without an estimate.
    fn tensions(&self) -> Option<PerMotor<RelativeTension>> {
        None
    }
}

/// Time between the samples of the motors' earlier positions, µs: a frame's time at 30 Hz,
/// whatever the camera's frame rate is.
pub const MOTOR_SAMPLE_US: u32 = 33_333;

/// Position of a target or a reference, and its velocity until the next position of the ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Aim {
    /// Where the ball is to be, µm.
    pub position: PerAxis<i32>,
    /// Mean velocity over the coming frame time, µm/s; zero for a target that rests.
    pub velocity: PerAxis<i32>,
}

impl Aim {
    /// Returns the aim of a target that rests.
    pub fn at(target: Point) -> Self {
        Self { position: target.micrometres(), velocity: [0; AXES] }
    }

    /// Returns the position a second later at the same velocity.
    pub(crate) fn a_second_later(&self) -> PerAxis<i32> {
        per_axis(|i| self.position[i].saturating_add(self.velocity[i]))
    }
}

/// A position of the ball, with the motor positions that belong to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Measurement {
    /// Position of the ball, µm, within ±4 m.
    pub ball: PerAxis<i32>,
    /// Variances of `ball` along x, y and z, µm²; see [`variances`].
    pub variances: PerAxis<i32>,
    /// Motor positions when the frame was captured, Q4 steps.
    pub motors: PerMotor<i32>,
    /// Motor positions [`MOTOR_SAMPLE_US`] before that, and twice as long before, Q4 steps: they
    /// tell how the motors turned.
    pub motors_before: [PerMotor<i32>; 2],
    /// Motor positions after ramping down from the moment the law's setpoint takes effect, with
    /// what is still under way through the moving average; Q4 steps.
    pub motors_ahead: PerMotor<i32>,
    /// Target of the ball when the law's setpoint takes effect, µm, within ±4 m.
    pub target: PerAxis<i32>,
    /// Mean velocity of the target over the frame time from then on, µm/s; zero where it rests.
    pub velocity: PerAxis<i32>,
}

impl Measurement {
    /// Returns the error e = position - target, µm.
    pub fn error(&self) -> PerAxis<i32> {
        per_axis(|i| self.ball[i] - self.target[i])
    }

    /// Returns whether the target moves.
    pub fn is_moving(&self) -> bool {
        self.velocity != [0; AXES]
    }
}

/// Standard deviations of a position that comes without a covariance, µm: those of a depth camera
/// at a distance of a metre that looks along x (docs/understand/method.md).
const DEFAULT_SD_UM: PerAxis<i32> = [2000, 1000, 1000];

/// Variance that no covariance contains, µm²: the ball swings, and ages are not exact to the
/// millisecond. (0.7 mm)²
const UNMODELLED_VARIANCE_UM2: i32 = 490_000;

/// Returns the variances that a law uses for a position, along x, y and z: µm², below 10^9 (the
/// wire has 16 bits of 10^4 µm²). The laws filter each axis alone and do not use covariances
/// between axes.
pub fn variances(covariance: Option<Covariance>) -> PerAxis<i32> {
    match covariance {
        None => DEFAULT_SD_UM.map(|sd| sd * sd),
        Some(Covariance { variances, .. }) => variances
            .map(|v| i32::from(v) * Covariance::SQUARE_MICROMETRES + UNMODELLED_VARIANCE_UM2),
    }
}

/// Motor rates that a law requests, and their duration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Setpoint {
    /// The rates.
    pub rates: MotorRates,
    /// Time that the change to them takes at least, µs.
    pub ramp_us: u32,
    /// Time that they hold, µs from when they take effect. The motors stop when nothing newer has
    /// come by then.
    pub valid_us: u32,
    /// Highest rate that the motors may have over the one that the target's velocity asks for,
    /// 1/256; 0 where the law does not say.
    pub room: u16,
    /// Span of the moving average over the step plan, ms, at most the configured one; `None` keeps
    /// the present span.
    pub span_ms: Option<u16>,
}

impl Setpoint {
    /// Returns a setpoint of these rates, as soon as the motors can, without an end.
    pub const fn at_once(rates: MotorRates) -> Self {
        Self { rates, ramp_us: 0, valid_us: u32::MAX, room: 0, span_ms: None }
    }

    /// Returns the setpoint that is in force `elapsed_us` after it took effect.
    #[must_use]
    pub fn after(self, elapsed_us: u64) -> Self {
        let elapsed_us = elapsed_us.min(u64::from(u32::MAX)) as u32;
        if elapsed_us >= self.valid_us {
            return Self::default();
        }
        Self { ramp_us: self.ramp_us.saturating_sub(elapsed_us), ..self }
    }
}

/// The least of the motors' limits, for laws that plan with them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotorLimits {
    /// Rate, Q8 steps/s.
    pub rate: i32,
    /// Acceleration, steps/s².
    pub acceleration: u32,
    /// Number of the motors.
    pub count: u8,
}

impl MotorLimits {
    /// Returns whether two motors move the ball in a plane.
    pub(super) fn is_planar(&self) -> bool {
        usize::from(self.count) < MOTORS
    }

    /// Returns the least of the limits of `count` motors; the limits of others are those of A.
    pub(crate) fn of(motors: &PerMotor<config::Motor>, count: u8) -> Self {
        let [a, b, c] = motors;
        Self {
            rate: a.max_rate.0.min(b.max_rate.0).min(c.max_rate.0),
            acceleration: a.max_acceleration.0.min(b.max_acceleration.0).min(c.max_acceleration.0),
            count,
        }
    }
}

/// Motor rates as a law requests them: full steps/s, Q8, + pays cable out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotorRates(pub PerMotor<i32>);

impl MotorRates {
    /// Scales the rates by one common factor, the largest up to 1 that brings each within its
    /// `limit` (above 0).
    ///
    /// The direction in motor space stays, up to rounding towards zero. So a law that lets |e| fall
    /// for any γ(e) > 0 still does.
    #[must_use]
    pub fn within(self, limits: PerMotor<i32>) -> Self {
        let magnitudes = self.0.map(i32::unsigned_abs);
        let limits = limits.map(i32::unsigned_abs);
        // The factor is limit/magnitude of the motor that exceeds its limit most.
        let (mut worst, mut limit, mut magnitude) = (None, 1, 1);
        for i in 0..MOTORS {
            if magnitudes[i] > limits[i]
                && (worst.is_none()
                    || product(limits[i], magnitude) < product(limit, magnitudes[i]))
            {
                (worst, limit, magnitude) = (Some(i), limits[i], magnitudes[i]);
            }
        }
        let Some(worst) = worst else { return self };
        let scale = scale_by_ratio(limit, magnitude);
        Self(per_motor(|i| {
            // The worst motor gets its limit exactly, without rounding.
            let scaled = if i == worst { limit } else { scale(magnitudes[i]) };
            if self.0[i] < 0 { -(scaled as i32) } else { scaled as i32 }
        }))
    }

    /// Returns three quarters of `limit` (Q8 steps/s, above 0) over the fastest of these rates,
    /// 1/256: the rest is for corrections. Saturates at 256 times.
    pub(super) fn room(self, limit: i32) -> u16 {
        let fastest = self.0.iter().map(|rate| rate.unsigned_abs()).max().unwrap_or(0);
        let room = u64::from(limit.unsigned_abs()) * 192 / u64::from(fastest.max(1));
        room.min(u16::MAX.into()) as u16
    }

    /// Returns 3/10 of the rates, rounded towards zero: the rates while positions are missing.
    #[must_use]
    pub fn coasting(self) -> Self {
        Self(self.0.map(|r| (i64::from(r) * 3 / 10) as i32))
    }
}
