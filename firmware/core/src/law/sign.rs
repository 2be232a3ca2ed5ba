//! The law `sign`: uses the signs of the Jacobian and nothing else. Its detection of overshoot
//! damps the law `adaptive` too, and its signs are those of every law.

use plumb_protocol::config;
use plumb_protocol::dimension::{AXES, LEAST_MOTORS, MOTORS, PerAxis, PerMotor};

use super::io::{Law, Measurement, MotorRates, Setpoint};
use crate::wide::signed_product;

/// Saturation of |e| for this law, µm: 4.19 m, 22 bits.
const MAX_ERROR_UM: i32 = (1 << 22) - 1;

/// u̇ = -g Σ⁻¹ e with a constant matrix. For every J with the signs Σ (and a zero where Σ
/// has one), -JΣ⁻¹ is stable by Routh and Hurwitz, whatever the sizes of its entries. If |e|
/// falls with one constant g > 0, it falls with every g > 0. Therefore the law may adapt g on the
/// way to a target: g grows while the ball is near and has not overshot, and falls at each
/// overshoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sign {
    /// Gain g/(4s), steps/s per µm, Q20, at most 2^20; s is the cable of one full step, µm.
    gain: i32,
    /// Whether two motors move the ball in a plane.
    is_planar: bool,
    /// Target, µm.
    target: PerAxis<i32>,
    /// Scale of the gain after overshoots, Q14.
    gain_scale: i32,
    /// Growth of the gain on the way, Q14.
    boost: i32,
    detector: OvershootDetector,
}

/// 1 in Q14: 15 bits.
const ONE: i32 = 1 << 14;
/// Factor on the gain at an overshoot, Q8.
const DAMPING: i32 = 205;
/// Least scale of the gain, Q14.
const MIN_GAIN_SCALE: i32 = ONE / 10;
/// Distance below which the gain is not boosted, µm: closer, it would amplify noise.
const MIN_BOOST_UM: u32 = 12_000;
/// Distance below which the boost grows, µm: farther, the motors turn as fast as they can.
const MAX_BOOST_UM: u32 = 80_000;
/// Growth of the boost with each measurement between these distances, Q8.
const BOOST_GROWTH: i32 = 264;
/// Largest boost, Q14.
const MAX_BOOST: i32 = 2 * ONE;
/// Saturation of distances, µm.
const MAX_DISTANCE_UM: u32 = MAX_BOOST_UM;
const _: () = assert!(MIN_OVERSHOOT_UM < MAX_DISTANCE_UM && MAX_DISTANCE_UM < 1 << 17);

impl Sign {
    /// Creates the law of a validated configuration with as many motors.
    pub(crate) fn new(config: &config::Sign, motor_count: u8) -> Self {
        Self {
            gain: config.gain.0 as i32,
            is_planar: usize::from(motor_count) < MOTORS,
            target: [0; AXES],
            gain_scale: ONE,
            boost: ONE,
            detector: OvershootDetector::default(),
        }
    }

    /// Returns the motor rates for the error `e` (position - target, µm), not limited yet.
    pub fn rates(&mut self, e: PerAxis<i32>) -> MotorRates {
        let e = e.map(|e| e.clamp(-MAX_ERROR_UM, MAX_ERROR_UM));
        let distance = distance(e);
        self.adapt_gain(e, distance);
        let boost = if distance > MIN_BOOST_UM { self.boost } else { ONE };
        // Bits: 15 + 16 = 31; gain 21 + 16 = 37, 22 after the shift.
        let gain = (signed_product(self.gain, (self.gain_scale * boost) >> 14) >> 14) as i32;
        // Bits: sum 25 + gain 22 = 47; Q20 to Q8 is 12 bits less.
        let limit = i64::from(i32::MAX);
        MotorRates(
            direction(e, self.is_planar)
                .map(|w| (signed_product(w, gain) >> 12).clamp(-limit, limit) as i32),
        )
    }

    /// Reduces the gain at an overshoot, and lets it grow before the first one.
    fn adapt_gain(&mut self, e: PerAxis<i32>, distance: u32) {
        if self.detector.overshoots(e, distance) {
            self.gain_scale = ((self.gain_scale * DAMPING) >> 8).max(MIN_GAIN_SCALE);
            self.boost = (self.boost + ONE) / 2;
        } else if self.gain_scale == ONE && MIN_BOOST_UM < distance && distance < MAX_BOOST_UM {
            self.boost = ((self.boost * BOOST_GROWTH) >> 8).min(MAX_BOOST);
        }
    }
}

/// Returns |e| in µm, accurate to 4 µm, or [`MAX_DISTANCE_UM`] where it is more.
pub(super) fn distance(e: PerAxis<i32>) -> u32 {
    let e = e.map(i32::unsigned_abs);
    if e.iter().any(|&c| c >= MAX_DISTANCE_UM) {
        return MAX_DISTANCE_UM;
    }
    // Bits: 15 + 15, 32 the sum of three. A root of 32 bits takes the chip a fraction of the time
    // of one of 64.
    let root = e.iter().map(|c| (c >> 2).wrapping_mul(c >> 2)).fold(0, u32::wrapping_add).isqrt();
    (root << 2).min(MAX_DISTANCE_UM)
}

/// Returns -4Σ⁻¹e, µm, 25 bits: the direction of the motor rates. In a plane Σ has the rows y and
/// z, and the columns A and B.
pub(super) fn direction(e: PerAxis<i32>, is_planar: bool) -> PerMotor<i32> {
    let [x, y, z] = e.map(|e| e.clamp(-MAX_ERROR_UM, MAX_ERROR_UM));
    if is_planar {
        return [2 * (y + z), 2 * (z - y), 0];
    }
    [x + 2 * y + z, x - 2 * y + z, 2 * (z - x)]
}

/// Returns Σ as i32, pattern (12) of the paper or that of two motors in a plane: row by row (x, y,
/// z), column by column (cable A, B, C). What the rig has not is 0.
pub(super) const fn signs(is_planar: bool) -> PerAxis<PerMotor<i32>> {
    let (mut signs, mut at) = ([[0; MOTORS]; AXES], 0);
    while at < AXES * MOTORS {
        let (axis, motor) = (at / MOTORS, at % MOTORS);
        signs[axis][motor] = if !is_planar {
            config::SIGNS[axis][motor] as i32
        } else if motor < LEAST_MOTORS {
            config::PLANAR_SIGNS[axis][motor] as i32
        } else {
            0
        };
        at += 1;
    }
    signs
}

impl Law for Sign {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        if self.target != measurement.target && !measurement.is_moving() {
            // The gain that fits the way to one target may not fit the way to another.
            (self.gain_scale, self.boost) = (ONE, ONE);
            self.detector = OvershootDetector::default();
            self.target = measurement.target;
        }
        Setpoint::at_once(self.rates(measurement.error()))
    }
}

/// Distance from the target below which noise hides an overshoot, µm.
const MIN_OVERSHOOT_UM: u32 = 7_000;

/// Detects that the ball changes over to the other side of its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct OvershootDetector {
    /// Error on the side where the ball was last, µm; zero at first.
    last: PerAxis<i32>,
}

impl OvershootDetector {
    /// Takes the error `e` (µm, 24 bits) and its length, and returns whether the ball has gone
    /// past its target since it was last farther than [`MIN_OVERSHOOT_UM`] from it.
    pub(super) fn overshoots(&mut self, e: PerAxis<i32>, distance: u32) -> bool {
        if distance <= MIN_OVERSHOOT_UM {
            return false;
        }
        // Bits: 24 + 24, 50 the sum.
        let along: i64 = (0..AXES).map(|i| signed_product(e[i], self.last[i])).sum();
        if along <= 0 {
            self.last = e;
        }
        along < 0
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::SignGain;

    use super::*;

    fn measurement(ball: [i32; 3], target: [i32; 3]) -> Measurement {
        Measurement {
            ball,
            variances: [0; 3],
            motors: [0; 3],
            motors_before: [[0; 3]; 2],
            motors_ahead: [0; 3],
            target,
            velocity: [0; 3],
        }
    }

    fn largest(setpoint: Setpoint) -> i32 {
        setpoint.rates.0.iter().map(|rate| rate.abs()).max().unwrap_or(0)
    }

    /// A ball that comes no nearer, and then one that jumps from one side of its target to the
    /// other.
    #[test]
    fn the_gain_falls_at_each_overshoot_and_grows_on_the_way() {
        let mut law = Sign::new(&config::Sign { gain: SignGain(1 << 14) }, 3);
        let mut rate = |x: i32| largest(law.update(&measurement([x, 0, 0], [0; 3])));
        let first = rate(50_000);
        let grown = (0..30).map(|_| rate(50_000)).last().unwrap_or(0);
        assert!((first * 19 / 10..2 * first).contains(&grown), "{first} {grown}");
        let thrown =
            (0..30).map(|k| rate(if k % 2 == 0 { -50_000 } else { 50_000 })).last().unwrap_or(0);
        assert!(thrown * 9 < first && thrown > 0, "{first} {thrown}");
    }

    #[test]
    fn another_target_is_driven_to_as_if_it_were_the_first() {
        let gain = config::Sign { gain: SignGain(1 << 14) };
        let (mut law, mut new) = (Sign::new(&gain, 3), Sign::new(&gain, 3));
        for x in [50_000, -40_000, 30_000] {
            law.update(&measurement([x, 0, 0], [0; 3]));
        }
        for x in [40_000, 20_000, 5_000] {
            let measurement = measurement([x, 0, 0], [0, 1_000, 0]);
            assert_eq!(law.update(&measurement), new.update(&measurement));
        }
    }
}
