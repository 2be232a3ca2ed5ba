//! The law `interval`: the paper's law for a Jacobian in a box of intervals.

use plumb_protocol::config;
use plumb_protocol::dimension::{AXES, MotorList, PerAxis, PerMotor};
use plumb_protocol::units::Bound;

use super::io::{Law, Measurement, MotorRates, Setpoint};
use crate::vector::{per_axis, per_motor};
use crate::wide::signed_product;

/// Fraction bits of v, which is in µm.
pub const V_FRACTION_BITS: u32 = 8;

/// Fraction bits of e in its product with a bound.
const E_FRACTION_BITS: u32 = 4;

/// Fraction bits of a bound.
const BOUND_BITS: u32 = 16;

/// Saturation of |e|: 2^27 in Q4 µm is 8.39 m.
pub(crate) const MAX_ERROR: i32 = (1 << 27) - 1;

/// Blanchini et al. (2023), eqs. (7) and (8) in explicit form: u̇ = -γ v. v_k is the number
/// nearest to zero in column k's interval [η_k, μ_k] of e'J. Then e'Jv >= |v|² for every J in
/// the family, so |e| falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Least value of each entry of J, signed, Q16, magnitude at most 2^19.
    lower: PerAxis<PerMotor<i32>>,
    /// Largest value of each entry of J, in the same format.
    upper: PerAxis<PerMotor<i32>>,
    /// Gain, Q16, at most 2^20: steps/s per µm of v.
    gain: i32,
}

impl Interval {
    /// Creates the law of a validated configuration.
    pub(crate) fn new(config: &config::Interval) -> Self {
        let entry = |i: usize, k: usize| {
            let bound =
                |rows: &PerAxis<MotorList<Bound>>| rows[i].get(k).map_or(0, |it| it.0 as i32);
            let (alpha, beta) = (bound(&config.alpha), bound(&config.beta));
            // A motor that the rig has not moves nothing.
            match config.signs[i].get(k).copied().unwrap_or(0) {
                0 => (0, 0),
                sign if sign > 0 => (alpha, beta),
                _ => (-beta, -alpha),
            }
        };
        Self {
            lower: per_axis(|i| per_motor(|k| entry(i, k).0)),
            upper: per_axis(|i| per_motor(|k| entry(i, k).1)),
            gain: config.gain.0 as i32,
        }
    }

    /// Returns v for the error `e` (position - target, µm), in µm with [`V_FRACTION_BITS`],
    /// rounded towards zero. |v| saturates at 2^27 (0.52 m).
    pub fn v(&self, e: PerAxis<i32>) -> PerMotor<i32> {
        let e = e.map(|e| {
            let most = MAX_ERROR >> E_FRACTION_BITS;
            if e > most {
                MAX_ERROR
            } else if e < -most {
                -MAX_ERROR
            } else {
                e << E_FRACTION_BITS
            }
        });
        let limbs = e.map(limbs);
        per_motor(|k| {
            let [mut eta, mut mu] = [[0; 3]; 2];
            for i in 0..AXES {
                let (lower, upper) = (self.lower[i][k], self.upper[i][k]);
                // A negative e swaps the bounds.
                let (least, most) = if e[i] < 0 { (upper, lower) } else { (lower, upper) };
                add_product(&mut eta, limbs[i], least);
                add_product(&mut mu, limbs[i], most);
            }
            // Bits: e 27 + bound 19 = 46, 48 the sum of three.
            let (eta, mu) = (whole(eta), whole(mu));
            let nearest_to_zero = eta.max(0) + mu.min(0);
            let shift = E_FRACTION_BITS + BOUND_BITS - V_FRACTION_BITS;
            let magnitude = (nearest_to_zero.unsigned_abs() >> shift).min(1 << 27) as i32;
            if nearest_to_zero < 0 { -magnitude } else { magnitude }
        })
    }

    /// Returns the motor rates u̇ = -γ v for the error `e` (position - target, µm), not limited
    /// yet.
    pub fn rates(&self, e: PerAxis<i32>) -> MotorRates {
        // Bits: v 27 + gain 20 = 47; v has the 8 fraction bits of a rate, so the gain's 16 go.
        MotorRates(self.v(e).map(|v| {
            let rate = -signed_product(v, self.gain) >> 16;
            rate.clamp(-i64::from(i32::MAX), i64::from(i32::MAX)) as i32
        }))
    }
}

/// Bits of a limb: a limb times a bound is 28 bits, three of them 30.
pub(crate) const LIMB_BITS: u32 = 9;

/// Splits a number of 27 bits and a sign into limbs, the highest with the sign. The chip multiplies
/// 32 bits in one clock, 64 in forty.
fn limbs(number: i32) -> [i32; 3] {
    let mask = (1 << LIMB_BITS) - 1;
    [number & mask, (number >> LIMB_BITS) & mask, number >> (2 * LIMB_BITS)]
}

/// Adds the product of limbs and a bound to `sum`; three products fit. Not checked for overflow: a
/// check takes 64 bits.
fn add_product(sum: &mut [i32; 3], limbs: [i32; 3], bound: i32) {
    for (sum, limb) in sum.iter_mut().zip(limbs) {
        *sum = sum.wrapping_add(limb.wrapping_mul(bound));
    }
}

/// Joins the limbs' sums to a number.
fn whole([low, middle, high]: [i32; 3]) -> i64 {
    i64::from(low) + (i64::from(middle) << LIMB_BITS) + (i64::from(high) << (2 * LIMB_BITS))
}

impl Law for Interval {
    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        Setpoint::at_once(self.rates(measurement.error()))
    }
}
