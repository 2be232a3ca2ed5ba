//! The law that knows nothing but the signs of the Jacobian.

use plumb_protocol::config;

use super::io::{Law, Measurement, Setpoint};
use super::rates::MotorRates;
use super::sides::{PAST, Sides};
use crate::wide::signed_product;

/// |e| saturates here for this law, µm: 4.19 m, 22 bits.
const E_MAX: i32 = (1 << 22) - 1;

/// u̇ = -g Σ⁻¹ e with a constant matrix. For every J with the signs Σ (and a zero where Σ has one)
/// -JΣ⁻¹ is stable, by Routh and Hurwitz, whatever the sizes of its entries; and any g > 0 lets |e|
/// fall where a constant one does. So g may be found on the way to a target: it grows while the
/// ball is near and has not gone past, and is cut each time that it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sign {
    /// g/(4s), Q20, at most 2^20: steps/s for a micrometre.
    gain: i32,
    /// Where the ball is to go, µm.
    target: [i32; 3],
    /// What is left of the gain after overshooting, Q14.
    calm: i32,
    /// What it has grown to on the way, Q14.
    bold: i32,
    sides: Sides,
}

/// 1 in Q14: 15 bits.
const ONE: i32 = 1 << 14;
/// The gain is cut to so much where the ball goes past its target, Q8, and at least this is left of
/// it, Q14.
const CUT: i32 = 205;
const CALMEST: i32 = ONE / 10;
/// The gain grows between these distances, µm, by so much with each measurement, Q8, up to so much,
/// Q14. Closer it is what it was at first, so that noise is not made more of; farther away the
/// motors turn as fast as they can.
const GROWS: (u32, u32) = (12_000, 80_000);
const GROWTH: i32 = 264;
const BOLDEST: i32 = 2 * ONE;
/// No distance is told that is greater, µm.
const FAR: u32 = GROWS.1;
const _: () = assert!(PAST < FAR && FAR < 1 << 17);

impl Sign {
    /// The law of a validated configuration.
    pub(crate) fn new(config: &config::Sign) -> Self {
        Self {
            gain: config.gain.0 as i32,
            target: [0; 3],
            calm: ONE,
            bold: ONE,
            sides: Sides::default(),
        }
    }

    /// The motor rates for the error `e` (position - target, µm), not limited yet.
    pub fn rates(&mut self, e: [i32; 3]) -> MotorRates {
        let e = e.map(|e| e.clamp(-E_MAX, E_MAX));
        let distance = distance(e);
        self.look_where(e, distance);
        let bold = if distance > GROWS.0 { self.bold } else { ONE };
        // Bits: 15 + 16 = 31; gain 21 + 16 = 37, 22 after the shift.
        let gain = (signed_product(self.gain, (self.calm * bold) >> 14) >> 14) as i32;
        // Bits: sum 25 + gain 22 = 47; Q20 to Q8 is 12 bits less.
        let limit = i64::from(i32::MAX);
        MotorRates(
            direction(e).map(|w| (signed_product(w, gain) >> 12).clamp(-limit, limit) as i32),
        )
    }

    /// Notices that the ball went past its target; until it does, goes faster and faster.
    fn look_where(&mut self, e: [i32; 3], distance: u32) {
        if self.sides.passed(e, distance) {
            self.calm = ((self.calm * CUT) >> 8).max(CALMEST);
            self.bold = (self.bold + ONE) / 2;
        } else if self.calm == ONE && GROWS.0 < distance && distance < GROWS.1 {
            self.bold = ((self.bold * GROWTH) >> 8).min(BOLDEST);
        }
    }
}

/// |e| in µm, right to 4, or [`FAR`] where it is more.
pub(super) fn distance(e: [i32; 3]) -> u32 {
    let e = e.map(i32::unsigned_abs);
    if e.iter().any(|&c| c >= FAR) {
        return FAR;
    }
    // Bits: 15 + 15, 32 the sum of three: a root of 32 takes the chip a fraction of one of 64.
    let root = e.iter().map(|c| (c >> 2).wrapping_mul(c >> 2)).fold(0, u32::wrapping_add).isqrt();
    (root << 2).min(FAR)
}

/// -4Σ⁻¹e, µm, 25 bits: the direction in which the motors turn.
pub(super) fn direction(e: [i32; 3]) -> [i32; 3] {
    let [x, y, z] = e.map(|e| e.clamp(-E_MAX, E_MAX));
    [x + 2 * y + z, x - 2 * y + z, 2 * (z - x)]
}

impl Law for Sign {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        if self.target != measurement.target {
            // What was learnt of the way to another target is not true of this one.
            (self.calm, self.bold, self.sides) = (ONE, ONE, Sides::default());
            self.target = measurement.target;
        }
        Setpoint::at_once(self.rates(measurement.error()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_protocol::units::SignGain;

    fn measurement(ball: [i32; 3], target: [i32; 3]) -> Measurement {
        Measurement {
            ball,
            variances: [0; 3],
            motors: [0; 3],
            motors_before: [[0; 3]; 2],
            motors_ahead: [0; 3],
            target,
        }
    }

    fn largest(setpoint: Setpoint) -> i32 {
        setpoint.rates.0.iter().map(|rate| rate.abs()).max().unwrap_or(0)
    }

    /// A ball that is thrown from one side of its target to the other, and one that comes nearer
    /// without ever getting there.
    #[test]
    fn the_gain_is_cut_at_each_passing_and_grows_on_the_way() {
        let mut law = Sign::new(&config::Sign { gain: SignGain(1 << 14) });
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
        let (mut law, mut new) = (Sign::new(&gain), Sign::new(&gain));
        for x in [50_000, -40_000, 30_000] {
            law.update(&measurement([x, 0, 0], [0; 3]));
        }
        for x in [40_000, 20_000, 5_000] {
            let measurement = measurement([x, 0, 0], [0, 1_000, 0]);
            assert_eq!(law.update(&measurement), new.update(&measurement));
        }
    }
}
