//! The law that keeps the cables taut: the rig's geometry is estimated while driving, and the
//! acceleration that is asked for is limited by what of it is unknown.
//!
//! In f32: additions, products, quotients and square roots are the same everywhere (IEEE 754), and
//! so is what `libm` makes of them, so that chip and emulation agree to the bit. Millimetres, motor
//! steps, seconds.

mod bank;
mod calm;
mod filter;
mod geometry;
mod prior;
mod seen;
#[cfg(test)]
mod tests;

use super::io::{Law, Limits, Measurement, Setpoint};
use super::rates::MotorRates;
use bank::{Bank, Belief, GRAVITY};
use calm::Watch;
use geometry::{Vector, along, dot, largest, scaled};
use seen::{Seen, millimetres, steps};

/// What the rates take to change, s: from a measurement to the next at 30 Hz.
const FRAME_S: f32 = 0.033;
/// Cables are taut while what the ball bears, its weight and what it is accelerated by, points into
/// the motors' triangle. Two standard deviations of what may slacken a cable shift the point where
/// it meets the motors' plane by no more than this, mm, and are below so much acceleration, mm/s²:
/// at an edge of the population's triangles there is room for 440 (1 % quantile).
const ASIDE: f32 = 14.0;
const UNKNOWN: f32 = 400.0;
/// The motors may always accelerate so much, steps/s².
const ALWAYS: f32 = 250.0;
/// Braking is planned with so much of the acceleration that is allowed: what the springs swing back
/// by is as much again.
const BRAKE: f32 = 0.5;
/// Rates are at most so much of the way that is left, 1/s.
const GAIN: f32 = 12.0;
/// Nearer than about this the ball is left alone, mm: it is what noise makes of the estimate, and
/// the microsteps of slow motors are in tune with a light ball on stiff cables.
const NEAR: f32 = 1.0;

/// A bank of extended Kalman filters over the geometry, and a plan by what they say together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taut {
    rate: f32,
    acceleration: f32,
    bank: Option<Bank>,
    /// Rates that were asked for last, steps/s.
    asked: Vector,
    watch: Watch,
}

impl Taut {
    /// The law for motors of these limits.
    pub(crate) fn new(limits: Limits) -> Self {
        let rate = limits.rate as f32 / 256.0;
        Self {
            rate,
            acceleration: limits.acceleration as f32,
            bank: None,
            asked: [0.0; 3],
            watch: Watch::new([f32::NAN; 3]),
        }
    }

    /// Takes the measurement into every filter; what they say.
    fn look(&mut self, seen: &Seen, target: Vector) -> Belief {
        match &mut self.bank {
            Some(bank) => {
                bank.update(seen, target);
                bank.belief(target)
            }
            none => none.insert(Bank::new(seen, target)).belief(target),
        }
    }

    /// What the motors may accelerate along `a` (largest entry 1), steps/s².
    fn acceleration(&self, belief: &Belief, a: Vector) -> f32 {
        let unknown = (GRAVITY * ASIDE / belief.height.max(1.0)).min(UNKNOWN);
        let known = unknown / (2.0 * belief.harm(a) + 1e-6);
        belief.tension(a).min(known).max(ALWAYS).min(self.acceleration)
    }

    /// The rates towards the target, before the change to them is limited: along the straight way
    /// in motor space, as fast as the ball can be stopped on what is left of it.
    fn wanted(&self, belief: &Belief, e: Vector, due: Vector, target: Vector) -> Vector {
        let Some(steps) = belief.steps(e) else { return [0.0; 3] };
        let unit = scaled(steps, 1.0 / largest(steps).max(1e-9));
        let way = belief.left(target, due, unit, largest(steps));
        let pace = self.watch.pace();
        let braking = pace * BRAKE * self.acceleration(belief, scaled(unit, -1.0));
        let heed = dot(e, e) / (dot(e, e) + NEAR * NEAR);
        scaled(
            unit,
            (heed * pace * GAIN * way).min(libm::sqrtf(2.0 * braking * way)).min(self.rate),
        )
    }

    /// The rates after a frame on the way from the last ones to `wanted`. To turn less fast along
    /// the way that the ball is on is one thing, of which much is known; to turn elsewhere is
    /// another.
    fn limited(&self, belief: &Belief, wanted: Vector) -> Vector {
        let asked = self.asked;
        let kept = (dot(wanted, asked) / dot(asked, asked).max(1e-9)).clamp(0.0, 1.0);
        let slower = self.in_a_frame(belief, scaled(asked, kept - 1.0));
        let other = self.in_a_frame(belief, [0, 1, 2].map(|i| wanted[i] - kept * asked[i]));
        [0, 1, 2].map(|i| asked[i] + slower[i] + other[i])
    }

    /// So much of a change of rates as the acceleration allows in a frame.
    fn in_a_frame(&self, belief: &Belief, change: Vector) -> Vector {
        let most = largest(change) / FRAME_S;
        if most < 1e-6 {
            return change;
        }
        let limit = self.acceleration(belief, scaled(change, 1.0 / largest(change)));
        scaled(change, (limit / most).min(1.0))
    }
}

impl Law for Taut {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        let target = millimetres(measurement.target);
        let belief = self.look(&Seen::of(measurement), target);
        let due = steps(measurement.motors, measurement.motors_ahead);
        let moves = along(&belief.j, due);
        let e = [0, 1, 2].map(|i| target[i] - belief.ball[i] - moves[i]);
        if self.watch.look(target, e) {
            self.bank = None;
        }
        let wanted = self.wanted(&belief, e, due, target);
        self.asked = self.limited(&belief, wanted);
        let rates = MotorRates(self.asked.map(|rate| (rate * 256.0) as i32));
        Setpoint { ramp_us: (FRAME_S * 1e6) as u32, ..Setpoint::at_once(rates) }
    }
}
