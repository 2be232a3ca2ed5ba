//! Division.

use super::{BIAS, INFINITY, NAN, SIGN, is_infinite, is_nan, is_normal, is_zero, parts, rounded};

/// Returns `a` / `b`. `whole` divides integers (the divisor is never 0) and returns quotient and
/// remainder.
#[inline(always)]
#[must_use]
pub fn divide(a: u32, b: u32, whole: impl Fn(u32, u32) -> (u32, u32)) -> u32 {
    let sign = (a ^ b) & SIGN;
    if !(is_normal(a) && is_normal(b))
        && let Some(special) = special(a, b)
    {
        return special;
    }
    let ((a, of_a), (b, of_b)) = (parts(a), parts(b));
    // Eight bits at a time: 2^24 a / b has 24 or 25 bits.
    let (first, rest) = whole(a << 8, b);
    let (second, rest) = whole(rest << 8, b);
    let (third, rest) = whole(rest << 8, b);
    let quotient = (first << 16).wrapping_add(second << 8).wrapping_add(third);
    let exponent = of_a.wrapping_sub(of_b).wrapping_add(BIAS);
    // One guard bit. The quotient of two significands is never a tie: a quotient whose guard bit is
    // 1, times the divisor, cannot have 24 zeros at its end.
    let (quotient, exponent, rest) = if quotient >> 24 == 0 {
        let (next, rest) =
            if rest << 1 >= b { (1, (rest << 1).wrapping_sub(b)) } else { (0, rest) };
        (quotient << 1 | next, exponent.wrapping_sub(1), rest)
    } else {
        (quotient, exponent, rest)
    };
    if (exponent.wrapping_sub(1) as u32) < 253 {
        return sign
            | ((exponent.wrapping_sub(1) as u32) << 23)
                .wrapping_add(quotient.wrapping_add(1) >> 1);
    }
    rounded(sign, exponent, quotient << 7 | u32::from(rest != 0))
}

/// Returns the quotient where an operand is 0, infinite or NaN.
#[inline(never)]
fn special(a: u32, b: u32) -> Option<u32> {
    let sign = (a ^ b) & SIGN;
    if is_nan(a) || is_nan(b) || is_zero(a) && is_zero(b) || is_infinite(a) && is_infinite(b) {
        Some(NAN)
    } else if is_infinite(a) || is_zero(b) {
        Some(sign | INFINITY)
    } else if is_zero(a) || is_infinite(b) {
        Some(sign)
    } else {
        None
    }
}
