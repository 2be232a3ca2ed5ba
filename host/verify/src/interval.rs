//! Interval arithmetic with outward rounding: the result of an operation contains the result for
//! every real in the operands.

use std::ops::{Add, Div, Mul, Neg, Sub};

use serde::Serialize;

/// The reals from `lo` to `hi`: [lo, hi] in JSON.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "[f64; 2]")]
pub struct Interval {
    /// The lower bound.
    pub lo: f64,
    /// The upper bound.
    pub hi: f64,
}

/// Returns the interval with each bound moved outwards to the next double. The rounding error of an
/// IEEE operation is at most half of that.
fn outward(lo: f64, hi: f64) -> Interval {
    Interval { lo: lo.next_down(), hi: hi.next_up() }
}

impl Interval {
    /// Returns the interval from `lo` to `hi`, without rounding. `lo` must not be above `hi`.
    #[must_use]
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// Returns the interval that contains `value` only.
    #[must_use]
    pub const fn point(value: f64) -> Self {
        Self { lo: value, hi: value }
    }

    /// Returns hi - lo.
    #[must_use]
    pub fn width(self) -> f64 {
        self.hi - self.lo
    }

    /// Returns the midpoint, rounded.
    #[must_use]
    pub fn midpoint(self) -> f64 {
        0.5 * (self.lo + self.hi)
    }

    /// Splits the interval at its midpoint.
    #[must_use]
    pub fn halves(self) -> [Self; 2] {
        [Self::new(self.lo, self.midpoint()), Self::new(self.midpoint(), self.hi)]
    }

    /// Returns the interval from the lower bound of `self` to the upper bound of `other`.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        Self { lo: self.lo, hi: other.hi }
    }

    /// Returns |x|.
    #[must_use]
    pub fn magnitude(self) -> Self {
        Self { lo: self.lo.max(-self.hi).max(0.0), hi: self.hi.max(-self.lo) }
    }

    /// Returns min(x, y) for x in `self` and y in `other`.
    #[must_use]
    pub fn min(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.min(other.hi) }
    }

    /// Returns max(x, y) for x in `self` and y in `other`.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { lo: self.lo.max(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Returns x². The lower bound is at least 0.
    #[must_use]
    pub fn square(self) -> Self {
        let (a, b) = (self.lo * self.lo, self.hi * self.hi);
        let lower = if self.lo <= 0.0 && self.hi >= 0.0 { 0.0 } else { a.min(b).next_down() };
        Self { lo: lower.max(0.0), hi: a.max(b).next_up() }
    }

    /// Returns √x. Negative parts of the interval count as 0.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = outward(self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt());
        Self { lo: root.lo.max(0.0), hi: root.hi }
    }
}

impl From<Interval> for [f64; 2] {
    fn from(it: Interval) -> Self {
        [it.lo, it.hi]
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        outward(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let ends = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        outward(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

impl Div for Interval {
    type Output = Self;
    /// Returns x/y; all reals if the divisor contains 0.
    fn div(self, other: Self) -> Self {
        if other.lo <= 0.0 && other.hi >= 0.0 {
            return Self::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        self * outward(1.0 / other.hi, 1.0 / other.lo)
    }
}

impl Mul<Interval> for f64 {
    type Output = Interval;
    fn mul(self, other: Interval) -> Interval {
        Interval::point(self) * other
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn interval() -> impl Strategy<Value = (Interval, f64)> {
        (-1e3f64..1e3, 0.0f64..10.0, 0.0f64..=1.0).prop_map(|(lo, width, part)| {
            let hi = lo + width;
            (Interval::new(lo, hi), (lo + part * (hi - lo)).clamp(lo, hi))
        })
    }

    proptest! {
        #[test]
        fn results_contain_the_result_for_every_member((a, x) in interval(), (b, y) in interval()) {
            let within = |i: Interval, v: f64| i.lo <= v && v <= i.hi;
            prop_assert!(within(a + b, x + y) && within(a - b, x - y) && within(a * b, x * y));
            prop_assert!(within(a / b, x / y) || y == 0.0);
            prop_assert!(within(a.square(), x * x) && within(a.square().sqrt(), x.abs()));
            prop_assert!(within(a.min(b), x.min(y)) && within(a.max(b), x.max(y)));
            prop_assert!(within(a.magnitude(), x.abs()));
        }
    }

    #[test]
    fn division_encloses_a_result_that_is_not_a_double() {
        let tenth = Interval::point(1.0) / Interval::point(10.0);
        assert!(tenth.lo < 0.1 && 0.1 < tenth.hi && tenth.width() < 1e-15);
    }
}
