//! IEEE 754 binary32 in software: sums, products, quotients and comparisons of bit patterns,
//! rounded to nearest, ties to even.
//!
//! Results are those of every conforming processor, bit for bit, subnormals and infinities
//! included; the payload of a NaN is not specified. The code is made for a Cortex-M0+: nothing of
//! 64 bits, and no product of which more than the lower 32 bits are needed. Each function handles
//! normal numbers itself, and leaves all others, and ties, to a general function beside it.

mod add;
mod compare;
mod divide;
mod multiply;

pub use add::add;
pub use compare::{equal, less, less_or_equal, unordered};
pub use divide::divide;
pub use multiply::multiply;

/// Sign bit.
const SIGN: u32 = 1 << 31;
/// Infinity.
const INFINITY: u32 = 0xff << 23;
/// A quiet NaN.
const NAN: u32 = 0x7fc0_0000;
/// Exponent bias.
const BIAS: i32 = 127;
/// Implicit leading bit of a normal number's significand.
const HIDDEN: u32 = 1 << 23;

/// Returns the biased exponent: 0 for zeros and subnormals, 255 for infinities and NaN.
#[inline(always)]
const fn exponent(a: u32) -> u32 {
    (a << 1) >> 24
}

/// Returns whether `a` is a normal number: not 0, subnormal, infinite or NaN.
#[inline(always)]
const fn is_normal(a: u32) -> bool {
    a.wrapping_sub(HIDDEN) << 1 < INFINITY.wrapping_sub(HIDDEN) << 1
}

#[inline(always)]
const fn is_nan(a: u32) -> bool {
    a << 1 > INFINITY << 1
}

#[inline(always)]
const fn is_infinite(a: u32) -> bool {
    a << 1 == INFINITY << 1
}

#[inline(always)]
const fn is_zero(a: u32) -> bool {
    a << 1 == 0
}

/// Returns the significand (24 bits) and the biased exponent of a finite number that is not 0. A
/// subnormal is normalised: its exponent is 0 or less.
const fn parts(a: u32) -> (u32, i32) {
    let kept = exponent(a) as i32;
    if kept > 0 {
        return (a & (HIDDEN - 1) | HIDDEN, kept);
    }
    let significand = a & (HIDDEN - 1);
    let shift = significand.leading_zeros() - 8;
    (significand << shift, 1 - shift as i32)
}

/// Shifts `a` right by `by` bits. The last bit is sticky: set where a 1 is shifted out.
const fn shifted(a: u32, by: u32) -> u32 {
    match by {
        0 => a,
        1..=31 => a >> by | (a << (32 - by) != 0) as u32,
        _ => (a != 0) as u32,
    }
}

/// Rounds `significand`, with its highest bit set and a sticky last bit, to the nearest number. The
/// exponent may be out of range.
const fn rounded(sign: u32, exponent: i32, significand: u32) -> u32 {
    if exponent >= 255 {
        return sign | INFINITY;
    }
    let (exponent, significand) = match exponent {
        1.. => (exponent as u32, significand),
        _ => (1, shifted(significand, (1 - exponent) as u32)),
    };
    let (kept, rest) = (significand >> 8, significand & 0xff);
    let up = rest > 0x80 || rest == 0x80 && kept & 1 == 1;
    // The hidden bit adds one to the exponent, and so does a carry. A subnormal has no hidden bit.
    sign | (((exponent - 1) << 23) + kept + up as u32)
}
