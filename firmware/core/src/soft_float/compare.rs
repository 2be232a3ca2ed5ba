//! Comparisons. Each but `unordered` is false where an operand is NaN.

use super::{INFINITY, is_nan, is_zero};

/// Returns whether `a` or `b` is NaN.
#[inline(always)]
#[must_use]
pub const fn unordered(a: u32, b: u32) -> bool {
    is_nan(a) || is_nan(b)
}

/// Returns whether `a` == `b`.
#[inline(always)]
#[must_use]
pub const fn equal(a: u32, b: u32) -> bool {
    if a == b { !is_nan(a) } else { is_zero(a | b) }
}

/// Returns whether `a` < `b`.
#[inline(always)]
#[must_use]
pub const fn less(a: u32, b: u32) -> bool {
    // The common case, both positive: where the greater is not NaN, neither is the other.
    if ((a | b) as i32) >= 0 {
        return a < b && b <= INFINITY;
    }
    // Of two negative numbers, the greater bit pattern is the lesser number.
    let less = if ((a & b) as i32) < 0 { a > b } else { (a as i32) < b as i32 };
    less && !unordered(a, b) && !is_zero(a | b)
}

/// Returns whether `a` <= `b`.
#[inline(always)]
#[must_use]
pub const fn less_or_equal(a: u32, b: u32) -> bool {
    if ((a | b) as i32) >= 0 {
        return a <= b && b <= INFINITY;
    }
    let less = if ((a & b) as i32) < 0 { a >= b } else { a as i32 <= b as i32 };
    (less || is_zero(a | b)) && !unordered(a, b)
}
