//! The law that knows nothing but the signs of the Jacobian.

use plumb_protocol::config;

use super::{Demand, Law, MotorRates, Picture};
use crate::wide::signed_product;

/// |e| saturates here for this law, µm: 4.19 m, 22 bits.
const E_MAX: i32 = (1 << 22) - 1;

/// u̇ = -g(e) Σ⁻¹ e with a constant matrix. For every J with the signs Σ (and a zero where Σ has one) -JΣ⁻¹ is stable, by
/// Routh and Hurwitz, whatever the sizes of its entries; and any g(e) > 0 lets |e| fall where a constant one does. It is
/// larger far away, where a late picture does little harm, and less after each time that the ball went past its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sign {
    /// g/(4s), Q20, at most 2^20: steps/s for a micrometre.
    gain: i32,
    /// What is left of the gain after overshooting, Q8.
    calm: i32,
    /// The error on the side of the target that the ball was on last, µm.
    side: [i32; 3],
}

/// At this |e| the gain is the one that is configured, µm.
const NOMINAL: u32 = 20_000;
/// Least and greatest multiple of it, Q8.
const FIRMNESS: (i32, i32) = (304, 320);
/// From here on the gain is the greatest, µm; no farther off is anything else.
const FAR: u32 = (NOMINAL >> 8) * FIRMNESS.1.unsigned_abs();
const _: () = assert!(PAST < FAR && FAR < 1 << 15);
/// Going past the target by less is noise, µm.
const PAST: u32 = 7_000;
/// The gain is cut to so much then, Q8, and at least this is left of it.
const CUT: i32 = 224;
const CALMEST: i32 = 176;

impl Sign {
    /// The law of a validated configuration.
    pub(crate) fn new(config: &config::Sign) -> Self {
        Self { gain: config.gain.0 as i32, calm: 256, side: [0; 3] }
    }

    /// The motor rates for the error `e` (position - target, µm), not limited yet.
    pub fn rates(&mut self, e: [i32; 3]) -> MotorRates {
        let e = e.map(|e| e.clamp(-E_MAX, E_MAX));
        let distance = distance(e);
        self.look_where(e, distance);
        let firmness = ((distance / (NOMINAL >> 8)) as i32).clamp(FIRMNESS.0, FIRMNESS.1);
        // Bits: gain 20 + 10 + 9 = 39, 23 after the shift.
        let gain = (signed_product(self.gain, firmness * self.calm) >> 16) as i32;
        // Bits: sum 25 + gain 22 = 47; Q20 to Q8 is 12 bits less.
        let limit = i64::from(i32::MAX);
        MotorRates(direction(e).map(|w| (signed_product(w, gain) >> 12).clamp(-limit, limit) as i32))
    }

    /// Notices that the ball went past its target.
    fn look_where(&mut self, e: [i32; 3], distance: u32) {
        // Bits: 22 + 22, 46 the sum.
        let along: i64 = (0..3).map(|i| signed_product(e[i], self.side[i])).sum();
        if along < 0 && distance > PAST {
            self.calm = ((self.calm * CUT) >> 8).max(CALMEST);
        }
        if along <= 0 && distance > PAST {
            self.side = e;
        }
    }
}

/// |e| in whole micrometres, or [`FAR`] where it is more.
fn distance(e: [i32; 3]) -> u32 {
    let e = e.map(i32::unsigned_abs);
    if e.iter().any(|&c| c >= FAR) {
        return FAR;
    }
    // Bits: 15 + 15, 32 the sum of three: a root of 32 takes the chip a fraction of one of 64.
    e.iter().map(|c| c.wrapping_mul(*c)).fold(0, u32::wrapping_add).isqrt().min(FAR)
}

/// -4Σ⁻¹e, µm, 25 bits: the direction in which the motors turn.
pub(super) fn direction(e: [i32; 3]) -> [i32; 3] {
    let [x, y, z] = e.map(|e| e.clamp(-E_MAX, E_MAX));
    [x + 2 * y + z, x - 2 * y + z, 2 * (z - x)]
}

impl Law for Sign {
    fn update(&mut self, picture: &Picture) -> Demand {
        Demand::at_once(self.rates(picture.error()))
    }
}
