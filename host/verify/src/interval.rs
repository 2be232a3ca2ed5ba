//! Intervals of reals whose ends are rounded outwards: what is computed with them holds for every
//! real in them.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// All reals from `lo` to `hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The least.
    pub lo: f64,
    /// The greatest.
    pub hi: f64,
}

/// From `lo` to `hi`, each moved outwards to the next double: IEEE operations err by half of that.
fn outward(lo: f64, hi: f64) -> Interval {
    Interval { lo: lo.next_down(), hi: hi.next_up() }
}

impl Interval {
    /// From `lo` to `hi`, exactly; in order.
    #[must_use]
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// A number alone.
    #[must_use]
    pub const fn point(value: f64) -> Self {
        Self { lo: value, hi: value }
    }

    /// hi - lo.
    #[must_use]
    pub fn width(self) -> f64 {
        self.hi - self.lo
    }

    /// About halfway from `lo` to `hi`.
    #[must_use]
    pub fn middle(self) -> f64 {
        0.5 * (self.lo + self.hi)
    }

    /// The two halves.
    #[must_use]
    pub fn halves(self) -> [Self; 2] {
        [Self::new(self.lo, self.middle()), Self::new(self.middle(), self.hi)]
    }

    /// From the lower end of this to the upper end of `other`.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        Self { lo: self.lo, hi: other.hi }
    }

    /// |x|.
    #[must_use]
    pub fn magnitude(self) -> Self {
        Self { lo: self.lo.max(-self.hi).max(0.0), hi: self.hi.max(-self.lo) }
    }

    /// From the lesser of both lower ends to the lesser of both upper ones.
    #[must_use]
    pub fn min(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.min(other.hi) }
    }

    /// From the greater of both lower ends to the greater of both upper ones.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { lo: self.lo.max(other.lo), hi: self.hi.max(other.hi) }
    }

    /// x², which is never below 0.
    #[must_use]
    pub fn square(self) -> Self {
        let (a, b) = (self.lo * self.lo, self.hi * self.hi);
        let least = if self.lo <= 0.0 && self.hi >= 0.0 { 0.0 } else { a.min(b).next_down() };
        Self { lo: least.max(0.0), hi: a.max(b).next_up() }
    }

    /// √x of what is not below 0.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = outward(self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt());
        Self { lo: root.lo.max(0.0), hi: root.hi }
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
    /// Everything, where 0 is among the divisors.
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
        fn results_hold_for_what_is_inside((a, x) in interval(), (b, y) in interval()) {
            let within = |i: Interval, v: f64| i.lo <= v && v <= i.hi;
            prop_assert!(within(a + b, x + y) && within(a - b, x - y) && within(a * b, x * y));
            prop_assert!(within(a / b, x / y) || y == 0.0);
            prop_assert!(within(a.square(), x * x) && within(a.square().sqrt(), x.abs()));
            prop_assert!(within(a.min(b), x.min(y)) && within(a.max(b), x.max(y)) && within(a.magnitude(), x.abs()));
            prop_assert!((a + b).lo < x + y || (a.width() == 0.0 && b.width() == 0.0) || (a + b).lo <= x + y);
        }
    }

    #[test]
    fn a_tenth_is_not_a_double_and_ends_say_so() {
        let tenth = Interval::point(1.0) / Interval::point(10.0);
        assert!(tenth.lo < 0.1 && 0.1 < tenth.hi && tenth.width() < 1e-15);
    }
}
