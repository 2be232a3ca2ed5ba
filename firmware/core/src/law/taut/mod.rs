//! The law that keeps the cables taut: the rig's geometry is estimated while driving, and the acceleration that is asked
//! for is limited by what of it is unknown.
//!
//! In f32: additions, products, quotients and square roots are the same everywhere (IEEE 754), and so is what `libm`
//! makes of them, so that chip and emulation agree to the bit. Millimetres, motor steps, seconds.

mod filter;
mod geometry;

use super::certified::SIGNS;
use super::{Demand, Law, Limits, MotorRates, Picture};
use filter::Filter;
use geometry::{Matrix, Vector, along, length, scaled, solve, transposed_times};

/// Gravity, mm/s².
const GRAVITY: f32 = 9810.0;
/// What the rates take to change, s: from a picture to the next at 30 Hz.
const FRAME_S: f32 = 0.033;
/// Of its tension at rest, each cable keeps so much.
const KEPT: f32 = 0.5;
/// Two standard deviations of the acceleration's unknown part stay below this, mm/s².
const UNKNOWN: f32 = 300.0;
/// The motors may always accelerate so much, steps/s².
const ALWAYS: f32 = 150.0;
/// Braking is planned with so much of the acceleration that is allowed.
const BRAKE: f32 = 0.5;
/// Below this |e| nothing is certified, mm.
const NEAR: f32 = 10.0;
/// The law of signs slows down from here, mm.
const SIGN_SLOWS: f32 = 50.0;
/// Another filter takes over when it explains what was seen better by this much (twice the logarithm of likelihoods).
const BETTER: f32 = 2.0;

/// Heights of the motors above the ball (mm) and cable of a step (mm) that the filters begin with.
const GUESSES: [(f32, f32); 4] = [(350.0, 0.26), (350.0, 0.6), (750.0, 0.26), (750.0, 0.6)];

/// A bank of extended Kalman filters over the geometry; the one that explains best what was seen is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taut {
    rate: f32,
    acceleration: f32,
    bank: Option<[Filter; GUESSES.len()]>,
    best: usize,
    /// Rates that were asked for last, steps/s.
    asked: Vector,
    /// Pictures since |e| was looked at, and what it was then, mm.
    patience: (u8, f32),
}

/// A bank that has not brought the ball 3 mm nearer in so many pictures, and not to within 6 mm, has got stuck.
const PATIENCE: u8 = 45;
const NEARER: f32 = 3.0;
const THERE: f32 = 6.0;

impl Taut {
    /// The law for motors of these limits.
    pub(crate) fn new(limits: Limits) -> Self {
        let rate = limits.rate as f32 / 256.0;
        Self {
            rate,
            acceleration: limits.acceleration as f32,
            bank: None,
            best: 0,
            asked: [0.0; 3],
            patience: (0, f32::MAX),
        }
    }

    /// Takes the picture into every filter; the one to be used.
    fn look(&mut self, ball: Vector, motors: Vector) -> Filter {
        let Some(bank) = &mut self.bank else {
            let bank = GUESSES.map(|(height, step)| Filter::new(ball, motors, height, step));
            return self.bank.insert(bank)[self.best];
        };
        let worst = bank.iter().fold(0.0, |worst: f32, filter| worst.max(filter.score()));
        for (filter, guess) in bank.iter_mut().zip(GUESSES) {
            filter.update(ball, motors);
            if !filter.sound() {
                *filter = Filter::restarted(ball, motors, guess, worst);
            }
        }
        for (i, filter) in bank.iter().enumerate() {
            if filter.score() < bank[self.best].score() - BETTER {
                self.best = i;
            }
        }
        bank[self.best]
    }

    /// Begins anew where the bank has got stuck: `distance` from the target, mm.
    fn check_progress(&mut self, distance: f32) {
        self.patience.0 += 1;
        if self.patience.0 >= PATIENCE {
            if distance > THERE && distance > self.patience.1 - NEARER {
                self.bank = None;
            }
            self.patience = (0, distance);
        }
    }

    /// The largest factor on the motors' acceleration `a` with which every cable keeps its part of the tension.
    fn tension(j: &Matrix, a: Vector) -> f32 {
        // T/m = -J'(g ẑ + J a), up to the step's length.
        let change = transposed_times(j, along(j, a));
        let mut factor = f32::MAX;
        for k in 0..3 {
            if change[k] > 0.0 {
                factor = factor.min((1.0 - KEPT) * GRAVITY * j[2][k].abs() / change[k]);
            }
        }
        factor
    }

    /// What the motors may accelerate along `a` (largest entry 1), steps/s².
    fn acceleration(&self, filter: &Filter, j: &Matrix, a: Vector, backwards: bool) -> f32 {
        let taut = Self::tension(j, if backwards { scaled(a, -1.0) } else { a });
        let known = UNKNOWN / (2.0 * filter.sd(a) + 1e-6);
        self.acceleration.min(taut.max(ALWAYS)).min(known.max(ALWAYS))
    }

    /// The rates towards the target, before the change to them is limited.
    fn wanted(&self, filter: &Filter, j: &Matrix, e: Vector) -> Vector {
        let distance = length(e);
        let steps = solve(j, e);
        let doubt = filter.doubt(steps, e);
        let certain = steps.is_some() && (distance < NEAR || doubt < 0.7 * distance * distance);
        let (direction, way) = match steps {
            Some(n) if certain => (n, largest(n)),
            _ => {
                let w = [-e[0] - 2.0 * e[1] - e[2], -e[0] + 2.0 * e[1] - e[2], 2.0 * (e[0] - e[2])];
                let most = j.iter().flatten().fold(1e-6, |m: f32, v| m.max(v.abs()));
                (w, steps.map_or(0.0, largest).max(distance / (2.0 * most)))
            }
        };
        let unit = scaled(direction, 1.0 / largest(direction).max(1e-9));
        let braking = self.acceleration(filter, j, unit, true);
        let mut rate = (8.0 * way).min(libm::sqrtf(2.0 * BRAKE * braking * way)).min(self.rate);
        if !certain {
            rate = rate.min(self.rate * (distance / SIGN_SLOWS).min(1.0));
        }
        scaled(unit, rate)
    }

    /// `wanted`, or so much of the way from the last rates to it as the acceleration allows in a frame.
    fn limited(&self, filter: &Filter, j: &Matrix, wanted: Vector) -> Vector {
        let change = [0, 1, 2].map(|i| wanted[i] - self.asked[i]);
        let most = largest(change) / FRAME_S;
        if most < 1e-6 {
            return wanted;
        }
        let unit = scaled(change, 1.0 / largest(change));
        let taut = Self::tension(j, unit);
        let known = UNKNOWN / (2.0 * filter.sd(unit) + 1e-6);
        let limit = self.acceleration.min(taut).min(known).max(ALWAYS).min(self.acceleration);
        let factor = (limit / most).min(1.0);
        [0, 1, 2].map(|i| self.asked[i] + factor * change[i])
    }
}

/// The largest magnitude.
fn largest(v: Vector) -> f32 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// J with every entry of Σ's sign and at least a hundredth of the largest.
fn projected(j: &Matrix) -> Matrix {
    let least = j.iter().flatten().fold(0.0, |m: f32, v| m.max(v.abs())) / 100.0;
    [0, 1, 2].map(|i| {
        [0, 1, 2].map(|k| match SIGNS[i][k] {
            0 => j[i][k],
            sign => sign as f32 * (sign as f32 * j[i][k]).max(least),
        })
    })
}

impl Law for Taut {
    fn update(&mut self, picture: &Picture) -> Demand {
        let steps = |p: [i32; 3]| p.map(|p| p as f32 / 16.0);
        let mm = |p: [i32; 3]| p.map(|p| p as f32 / 1000.0);
        let filter = self.look(mm(picture.ball), steps(picture.then));
        let j = projected(&filter.jacobian());
        let due = [0, 1, 2].map(|k| (picture.ahead[k] - picture.then[k]) as f32 / 16.0);
        let (ball, moves, target) = (filter.ball(), along(&j, due), mm(picture.target));
        let e = [0, 1, 2].map(|i| target[i] - ball[i] - moves[i]);
        let wanted = self.wanted(&filter, &j, e);
        self.check_progress(length(e));
        self.asked = self.limited(&filter, &j, wanted);
        let rates = MotorRates(self.asked.map(|rate| (rate * 256.0) as i32));
        Demand { rates, ramp_us: (FRAME_S * 1e6) as u32 }
    }
}
