//! The paper's law for a Jacobian known only to lie in a box of intervals.

use plumb_protocol::config;

use super::{Demand, Law, MotorRates, Picture};

/// Fraction bits of v: micrometres with 8 fraction bits.
pub const V_FRACTION_BITS: u32 = 8;

/// Fraction bits that e is given before it meets a bound.
const E_FRACTION_BITS: u32 = 4;

/// Fraction bits of a bound.
const BOUND_BITS: u32 = 16;

/// |e| saturates here: 2^27 in Q4 is 8.39 m.
const E_MAX: i32 = (1 << 27) - 1;

/// Blanchini et al. (2023), eqs. (7) and (8) in explicit form: u̇ = -γ v, where v_k is what of column k's interval
/// [η_k, μ_k] of e'J is nearest to zero. Then e'Jv >= |v|² for every J in the family, so |e| falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Least value of each entry of J, signed, Q16, |.| <= 2^19.
    lower: [[i32; 3]; 3],
    /// Largest value of each entry of J, likewise.
    upper: [[i32; 3]; 3],
    /// Q16, at most 2^20: steps/s for a micrometre of v.
    gain: i32,
}

impl Interval {
    /// The law of a validated configuration (see [`Params`](crate::params::Params)).
    pub(crate) fn new(config: &config::Interval) -> Self {
        let entry = |i: usize, k: usize| {
            let (alpha, beta) = (config.alpha[i][k].0 as i32, config.beta[i][k].0 as i32);
            match config.signs[i][k] {
                0 => (0, 0),
                sign if sign > 0 => (alpha, beta),
                _ => (-beta, -alpha),
            }
        };
        let rows = [0, 1, 2];
        Self {
            lower: rows.map(|i| rows.map(|k| entry(i, k).0)),
            upper: rows.map(|i| rows.map(|k| entry(i, k).1)),
            gain: config.gain.0 as i32,
        }
    }

    /// v for the error `e` (position - target, µm), in µm with [`V_FRACTION_BITS`], rounded towards zero.
    ///
    /// |v| saturates at 2^27 (0.52 m).
    pub fn v(&self, e: [i32; 3]) -> [i32; 3] {
        let e = e.map(|e| (i64::from(e) << E_FRACTION_BITS).clamp(-i64::from(E_MAX), i64::from(E_MAX)));
        [0, 1, 2].map(|k| {
            // Bits: e 27 + bound 19 = 46 a product, 48 the sum of three.
            let products =
                [0, 1, 2].map(|i| (e[i] * i64::from(self.lower[i][k]), e[i] * i64::from(self.upper[i][k])));
            let eta: i64 = products.iter().map(|(a, b)| a.min(b)).sum();
            let mu: i64 = products.iter().map(|(a, b)| a.max(b)).sum();
            let nearest_to_zero = eta.max(0) + mu.min(0);
            let shift = E_FRACTION_BITS + BOUND_BITS - V_FRACTION_BITS;
            let magnitude = (nearest_to_zero.unsigned_abs() >> shift).min(1 << 27) as i32;
            if nearest_to_zero < 0 { -magnitude } else { magnitude }
        })
    }

    /// The motor rates u̇ = -γ v for the error `e` (position - target, µm), not limited yet.
    pub fn rates(&self, e: [i32; 3]) -> MotorRates {
        // Bits: v 27 + gain 20 = 47; v has the 8 fraction bits of a rate, so the gain's 16 go.
        MotorRates(self.v(e).map(|v| {
            let product = -(i64::from(v) * i64::from(self.gain)) >> 16;
            product.clamp(-i64::from(i32::MAX), i64::from(i32::MAX)) as i32
        }))
    }
}

impl Law for Interval {
    fn update(&mut self, picture: &Picture) -> Demand {
        Demand::at_once(self.rates(picture.error()))
    }
}
