//! Numbers of 32 bits (IEEE 754 binary32) on a processor that has none: sums, products, quotients
//! and comparisons of their bit patterns, rounded to nearest, ties to even.
//!
//! What comes out is what every other machine computes, bit for bit, subnormals and infinities
//! included; any NaN is as good as another. For a Cortex-M0+: nothing of 64 bits, no product of
//! which more than the lower 32 bits are needed, no counting of leading zeros. Each function does
//! ordinary numbers at once and leaves the rest, and what lies half way between two numbers, to a
//! general one beside it.

mod add;
mod compare;
mod divide;
mod multiply;

pub use add::add;
pub use compare::{equal, less, less_or_equal, unordered};
pub use divide::divide;
pub use multiply::multiply;

/// The sign's bit.
const SIGN: u32 = 1 << 31;
/// Infinity.
const INFINITY: u32 = 0xff << 23;
/// A quiet NaN.
const NAN: u32 = 0x7fc0_0000;
/// The exponent is kept greater by this.
const BIAS: i32 = 127;
/// The bit that is not kept, of a normal number's significand.
const HIDDEN: u32 = 1 << 23;

/// The exponent as it is kept: 0 of zeros and subnormals, 255 of infinities and NaN.
#[inline(always)]
const fn exponent(a: u32) -> u32 {
    (a << 1) >> 24
}

/// Whether `a` is neither 0 nor subnormal, infinite or NaN.
#[inline(always)]
const fn is_ordinary(a: u32) -> bool {
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

/// How far a number that is not 0 is to be shifted to the left for its highest bit to be the
/// highest of 32.
const fn leading_zeros(mut a: u32) -> u32 {
    let mut zeros = 0;
    if a >> 16 == 0 {
        (a, zeros) = (a << 16, 16);
    }
    if a >> 24 == 0 {
        (a, zeros) = (a << 8, zeros + 8);
    }
    if a >> 28 == 0 {
        (a, zeros) = (a << 4, zeros + 4);
    }
    if a >> 30 == 0 {
        (a, zeros) = (a << 2, zeros + 2);
    }
    if a >> 31 == 0 { zeros + 1 } else { zeros }
}

/// Significand of 24 bits and exponent of a finite number that is not 0. A subnormal's exponent is
/// less than any that is kept.
const fn parts(a: u32) -> (u32, i32) {
    let kept = exponent(a) as i32;
    if kept > 0 {
        return (a & (HIDDEN - 1) | HIDDEN, kept);
    }
    let significand = a & (HIDDEN - 1);
    let shift = leading_zeros(significand) - 8;
    (significand << shift, 1 - shift as i32)
}

/// `a` over 2^`by`, its last bit set where something is lost.
const fn shifted(a: u32, by: u32) -> u32 {
    match by {
        0 => a,
        1..=31 => a >> by | (a << (32 - by) != 0) as u32,
        _ => (a != 0) as u32,
    }
}

/// The nearest number to `significand`, whose highest bit is set and whose last one is where
/// something below it was, at an exponent that may be out of range.
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
    // The hidden bit makes the exponent one greater, and so does a carry; of a subnormal there is
    // none.
    sign | (((exponent - 1) << 23) + kept + up as u32)
}
