//! Multiplication.

use super::{
    BIAS, HIDDEN, INFINITY, NAN, SIGN, exponent, is_infinite, is_nan, is_normal, is_zero, parts,
    rounded,
};

/// Returns `a` times `b`.
#[inline(always)]
#[must_use]
pub fn multiply(a: u32, b: u32) -> u32 {
    if !(is_normal(a) && is_normal(b)) {
        return multiply_any(a, b);
    }
    let product = upper(a & (HIDDEN - 1) | HIDDEN, b & (HIDDEN - 1) | HIDDEN);
    // A product of 2 or more has one bit more.
    if product >> 31 == 0 { checked::<7>(a, b, product) } else { checked::<8>(a, b, product) }
}

/// Rounds `product`, the upper bits of `a` times `b`, by its lowest `BELOW` bits.
#[inline(always)]
fn checked<const BELOW: u32>(a: u32, b: u32, product: u32) -> u32 {
    // Bits below these 32 matter for ties only.
    let up = product.wrapping_add(1 << (BELOW - 1));
    // Signs and exponents are added in one sum; the hidden bit adds to it.
    let top = (a >> 23).wrapping_add(b >> 23).wrapping_sub(BIAS as u32 + 8 - BELOW);
    let result = (top << 23).wrapping_add(up >> BELOW);
    // An exponent out of range has changed the sign, or is not that of a normal number.
    if up << (32 - BELOW) == 0
        || ((result ^ a ^ b) as i32) < 0
        || exponent(result).wrapping_sub(1) >= 254
    {
        return multiply_any(a, b);
    }
    result
}

/// Returns the upper 32 of the 48 bits of a product of two numbers of 24 bits.
#[inline(always)]
const fn upper(a: u32, b: u32) -> u32 {
    let (a_high, a_low, b_high, b_low) = (a >> 8, a & 0xff, b >> 8, b & 0xff);
    let middle = a_high.wrapping_mul(b_low).wrapping_add(a_low.wrapping_mul(b_high));
    let lower = middle.wrapping_add(a_low.wrapping_mul(b_low) >> 8);
    a_high.wrapping_mul(b_high).wrapping_add(lower >> 8)
}

/// Returns `a` times `b`, of any class.
#[inline(never)]
fn multiply_any(a: u32, b: u32) -> u32 {
    let sign = (a ^ b) & SIGN;
    if (is_zero(a) || is_zero(b)) && exponent(a) < 255 && exponent(b) < 255 {
        return sign;
    }
    if is_nan(a) || is_nan(b) || is_zero(a) || is_zero(b) {
        return NAN;
    }
    if is_infinite(a) || is_infinite(b) {
        return sign | INFINITY;
    }
    let ((a, of_a), (b, of_b)) = (parts(a), parts(b));
    let product = upper(a, b);
    let lost = a.wrapping_mul(b) << 16 != 0;
    let shift = 1 - (product >> 31);
    // The shift moves a 0 in below the guard bits, where only the sticky bit counts.
    rounded(sign, of_a + of_b - BIAS + 1 - shift as i32, product << shift | lost as u32)
}
