//! Control laws: from the ball's error to motor rates.

mod adaptive;
mod axis;
mod interval;
mod sides;
mod sign;
mod solve;
mod taut;

use plumb_protocol::config;
use plumb_protocol::units::Covariance;

use crate::wide::{part, product};

pub use adaptive::Adaptive;
pub use interval::{Interval, V_FRACTION_BITS};
pub use sign::Sign;
pub use taut::Taut;

/// Motor rates as a law asks for them: full steps/s with 8 fraction bits, + pays cable out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotorRates(pub [i32; 3]);

impl MotorRates {
    /// These rates with one common factor, the largest up to 1 that brings each within its `limit`
    /// (above 0).
    ///
    /// The direction in motor space stays, up to rounding towards zero: a law that lets |e| fall
    /// for any γ(e) > 0 keeps doing so.
    #[must_use]
    pub fn within(self, limits: [i32; 3]) -> Self {
        let magnitudes = self.0.map(i32::unsigned_abs);
        let limits = limits.map(i32::unsigned_abs);
        // The factor is limit/magnitude of the motor that exceeds its limit most.
        let (mut worst, mut limit, mut magnitude) = (None, 1, 1);
        for i in 0..3 {
            if magnitudes[i] > limits[i]
                && (worst.is_none()
                    || product(limits[i], magnitude) < product(limit, magnitudes[i]))
            {
                (worst, limit, magnitude) = (Some(i), limits[i], magnitudes[i]);
            }
        }
        let Some(worst) = worst else { return self };
        let part_of = part(limit, magnitude);
        Self([0, 1, 2].map(|i| {
            // Of the motor itself the limit, and less of the others.
            let part = if i == worst { limit } else { part_of(magnitudes[i]) };
            if self.0[i] < 0 { -(part as i32) } else { part as i32 }
        }))
    }

    /// These rates times 3/10, rounded towards zero: what is left of them while positions fail to
    /// come.
    #[must_use]
    pub fn coasting(self) -> Self {
        Self(self.0.map(|r| (i64::from(r) * 3 / 10) as i32))
    }
}

/// From one of a picture's earlier places of the motors to the next, µs: a picture's time at 30 Hz,
/// however often pictures come.
pub const BEFORE_US: u32 = 33_333;

/// What a law sees: a position of the ball, and the motors' positions that belong to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picture {
    /// The ball, µm, within ±4 m.
    pub ball: [i32; 3],
    /// How sure that is: variances, µm², by [`variances`].
    pub variances: [i32; 3],
    /// Where the motors were when the picture was taken, 1/16 steps.
    pub then: [i32; 3],
    /// Where they were [`BEFORE_US`] before that, and twice as long before, 1/16 steps: how they
    /// turned.
    pub before: [[i32; 3]; 2],
    /// Where the motors go on to if nothing is wanted any more from the moment that the law's
    /// answer takes effect, but what is on its way through the running mean; 1/16 steps.
    pub ahead: [i32; 3],
    /// Where the ball is to go, µm, within ±4 m.
    pub target: [i32; 3],
}

/// Standard deviations of a position of which nothing is said, µm: those of a depth camera a metre
/// away that looks along x (docs/understand/method.md).
const USUAL: [i32; 3] = [2000, 1000, 1000];

/// What no covariance knows of, as a variance, µm²: the ball swings, and ages are not exact to the
/// millisecond. (0.7 mm)²
const UNTOLD: i32 = 490_000;

/// What a law is to make of a position's covariance, along x, y and z: variances in µm², below 10^9
/// (the wire's 16 bits of 10^4 µm²). The laws take the axes one by one and have no use for what is
/// between them.
pub fn variances(covariance: Option<Covariance>) -> [i32; 3] {
    match covariance {
        None => USUAL.map(|sd| sd * sd),
        Some(told) => {
            told.variances.map(|v| i32::from(v) * Covariance::SQUARE_MICROMETRES + UNTOLD)
        }
    }
}

impl Picture {
    /// e = position - target, µm.
    pub fn error(&self) -> [i32; 3] {
        [0, 1, 2].map(|i| self.ball[i] - self.target[i])
    }
}

/// What a law wants of the motors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Demand {
    /// The rates.
    pub rates: MotorRates,
    /// How long the change to them takes at least, µs.
    pub ramp_us: u32,
    /// How long they hold, µs from when they take effect: where nothing newer has come by then, the
    /// motors stop.
    pub lasts_us: u32,
}

impl Demand {
    /// These rates as soon as the motors can.
    pub const fn at_once(rates: MotorRates) -> Self {
        Self { rates, ramp_us: 0, lasts_us: u32::MAX }
    }

    /// What is wanted `gone` µs after it took effect.
    #[must_use]
    pub fn after(self, gone: u64) -> Self {
        let gone = gone.min(u64::from(u32::MAX)) as u32;
        if gone >= self.lasts_us {
            return Self::default();
        }
        Self { ramp_us: self.ramp_us.saturating_sub(gone), ..self }
    }
}

/// A control law with its state.
pub trait Law {
    /// Takes in a picture; what the motors are to do until the next one, not limited yet.
    fn update(&mut self, picture: &Picture) -> Demand;
}

/// The least of the motors' limits, for laws that plan with them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Q8 steps/s.
    pub rate: i32,
    /// Steps/s².
    pub acceleration: u32,
}

impl Limits {
    /// The least of these motors' limits.
    pub(crate) fn of(motors: &[config::Motor; 3]) -> Self {
        let [a, b, c] = motors;
        Self {
            rate: a.max_rate.0.min(b.max_rate.0).min(c.max_rate.0),
            acceleration: a.max_acceleration.0.min(b.max_acceleration.0).min(c.max_acceleration.0),
        }
    }
}

/// A law that answers within the tick in which a picture comes, with its state. The others are in
/// [`think`](crate::think).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quick {
    /// See [`Interval`].
    Interval(Interval),
    /// See [`Sign`].
    Sign(Sign),
}

impl Law for Quick {
    #[inline(never)]
    fn update(&mut self, picture: &Picture) -> Demand {
        match self {
            Self::Interval(law) => law.update(picture),
            Self::Sign(law) => law.update(picture),
        }
    }
}
