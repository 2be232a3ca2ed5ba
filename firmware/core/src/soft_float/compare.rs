//! Comparisons. Each is false where one of the two is NaN, but for the one that says so.

use super::{INFINITY, is_nan, is_zero};

/// Whether `a` or `b` is NaN.
#[inline(always)]
#[must_use]
pub const fn unordered(a: u32, b: u32) -> bool {
    is_nan(a) || is_nan(b)
}

/// `a` == `b`.
#[inline(always)]
#[must_use]
pub const fn equal(a: u32, b: u32) -> bool {
    if a == b { !is_nan(a) } else { is_zero(a | b) }
}

/// `a` < `b`.
#[inline(always)]
#[must_use]
pub const fn less(a: u32, b: u32) -> bool {
    // Two that are not negative, most often; the greater is not NaN, nor then the other.
    if ((a | b) as i32) >= 0 {
        return a < b && b <= INFINITY;
    }
    // Of two negative ones the greater pattern is the lesser number.
    let less = if ((a & b) as i32) < 0 { a > b } else { (a as i32) < b as i32 };
    less && !unordered(a, b) && !is_zero(a | b)
}

/// `a` <= `b`.
#[inline(always)]
#[must_use]
pub const fn less_or_equal(a: u32, b: u32) -> bool {
    if ((a | b) as i32) >= 0 {
        return a <= b && b <= INFINITY;
    }
    let less = if ((a & b) as i32) < 0 { a >= b } else { a as i32 <= b as i32 };
    (less || is_zero(a | b)) && !unordered(a, b)
}
