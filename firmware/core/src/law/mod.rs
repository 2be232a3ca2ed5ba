//! Control laws: from the ball's error to motor rates.

mod interval;

pub use interval::{Interval, V_FRACTION_BITS};

/// Motor rates as a law asks for them: full steps/s with 8 fraction bits, + pays cable out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotorRates(pub [i32; 3]);

impl MotorRates {
    /// These rates with one common factor, the largest up to 1 that brings each within its `limit` (above 0).
    ///
    /// The direction in motor space stays, up to rounding towards zero: a law that lets |e| fall for any γ(e) > 0
    /// keeps doing so.
    #[must_use]
    pub fn within(self, limits: [i32; 3]) -> Self {
        let magnitudes = self.0.map(|r| i64::from(r.unsigned_abs()));
        let limits = limits.map(i64::from);
        // The factor is limit/magnitude of the motor that exceeds its limit most; 31 + 31 bits a product.
        let mut worst = None;
        for i in 0..3 {
            let (limit, magnitude) = worst.unwrap_or((1, 1));
            if limits[i] * magnitude < limit * magnitudes[i] {
                worst = Some((limits[i], magnitudes[i]));
            }
        }
        match worst {
            None => self,
            Some((limit, magnitude)) => Self(self.0.map(|r| (i64::from(r) * limit / magnitude) as i32)),
        }
    }

    /// These rates times 3/10, rounded towards zero: what is left of them while positions fail to come.
    #[must_use]
    pub fn coasting(self) -> Self {
        Self(self.0.map(|r| (i64::from(r) * 3 / 10) as i32))
    }
}
