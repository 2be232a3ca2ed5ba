//! Motor rates and the operations on them that keep their direction.

use crate::wide::{product, scale_by_ratio};

/// Motor rates as a law requests them: full steps/s, Q8, + pays cable out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotorRates(pub [i32; 3]);

impl MotorRates {
    /// Scales the rates by one common factor, the largest up to 1 that brings each within its
    /// `limit` (above 0).
    ///
    /// The direction in motor space stays, up to rounding towards zero. So a law that lets |e| fall
    /// for any γ(e) > 0 still does.
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
        let scale = scale_by_ratio(limit, magnitude);
        Self([0, 1, 2].map(|i| {
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
