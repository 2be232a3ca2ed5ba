//! IEEE 754 binary32 in software: sums, products, quotients and comparisons of bit patterns,
//! rounded to nearest, ties to even.
//!
//! Results are those of every conforming processor, bit for bit, subnormals and infinities
//! included; the payload of a NaN is not specified. The code is made for a Cortex-M0+: nothing of
//! 64 bits, and no product of which more than the lower 32 bits are needed. Each function handles
//! normal numbers itself, and leaves all others, and ties, to a general function beside it.

/// Sign bit.
const SIGN: u32 = 1 << 31;
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

/// Leading bit of a significand with 7 guard bits.
const TOP: u32 = HIDDEN << 7;

/// Returns `a` + `b`.
#[inline(always)]
#[must_use]
pub fn add(a: u32, b: u32) -> u32 {
    // The code is instantiated twice, so that no registers change places.
    if a << 1 < b << 1 { add_lesser(b, a) } else { add_lesser(a, b) }
}

/// Returns `a` + `b` for |a| >= |b|.
#[inline(always)]
fn add_lesser(a: u32, b: u32) -> u32 {
    let (above, below) = (exponent(a), exponent(b));
    if above > 253 || below == 0 {
        return add_any(a, b);
    }
    let apart = above.wrapping_sub(below);
    if apart > 25 {
        return a;
    }
    // Bits that are shifted out matter for ties only.
    let (greater, smaller) = ((a << 8 | SIGN) >> 1, ((b << 8 | SIGN) >> 1).wrapping_shr(apart));
    if ((a ^ b) as i32) >= 0 {
        let sum = greater.wrapping_add(smaller);
        if sum >> 31 == 0 { packed::<7>(a, b, sum) } else { packed::<8>(a, b, sum) }
    } else {
        let difference = greater.wrapping_sub(smaller);
        if difference >= TOP {
            packed::<7>(a, b, difference)
        } else if difference >= TOP >> 1 && exponent(a) > 1 {
            packed::<6>(a, b, difference)
        } else {
            cancelled(a, difference)
        }
    }
}

/// Rounds `sum` by its lowest `BELOW` bits: 7 where it has the exponent of `a`. Ties are resolved
/// from `a` and `b`.
#[inline(always)]
fn packed<const BELOW: u32>(a: u32, b: u32, sum: u32) -> u32 {
    let up = sum.wrapping_add(1 << (BELOW - 1));
    if up << (32 - BELOW) == 0 {
        return round_tie::<BELOW>(a, b, up);
    }
    with_exponent::<BELOW>(a, up >> BELOW)
}

/// Rounds a tie to even, unless bits of `b` were shifted out.
#[inline(never)]
fn round_tie<const BELOW: u32>(a: u32, b: u32, up: u32) -> u32 {
    if exponent(a).wrapping_sub(exponent(b)) > 7 {
        add_any(a, b)
    } else {
        with_exponent::<BELOW>(a, up >> BELOW & !1)
    }
}

/// Packs a significand with the sign and exponent of `a`. Its hidden bit and a carry add to the
/// exponent.
#[inline(always)]
fn with_exponent<const BELOW: u32>(a: u32, significand: u32) -> u32 {
    ((a >> 23).wrapping_add(BELOW).wrapping_sub(8) << 23).wrapping_add(significand)
}

/// Returns the difference of two numbers of about one size, with the sign of `a`: leading bits have
/// cancelled, and no rounding is needed.
#[inline(never)]
fn cancelled(a: u32, difference: u32) -> u32 {
    if difference == 0 {
        return 0;
    }
    let highest = (a >> 23).wrapping_sub(1);
    // A subnormal has no hidden bit, and the exponent of the least normal number.
    let shift = (difference.leading_zeros().wrapping_sub(1)).min(highest & 0xff);
    (highest.wrapping_sub(shift) << 23).wrapping_add(difference.wrapping_shl(shift) >> 7)
}

/// Returns `a` + `b` for |a| >= |b|, of any class.
#[inline(never)]
fn add_any(a: u32, b: u32) -> u32 {
    if is_zero(b) && !is_nan(a) {
        // -0 + -0 is -0; zeros of other signs sum to +0.
        return if is_zero(a) { a & b } else { a };
    }
    if is_nan(a) || is_infinite(a) && b == a ^ SIGN {
        return NAN;
    }
    if is_infinite(a) {
        return a & SIGN | INFINITY;
    }
    let ((greater, above), (smaller, below)) = (parts(a), parts(b));
    let (greater, smaller) = (greater << 7, shifted(smaller << 7, (above - below) as u32));
    let sum = if (a ^ b) & SIGN == 0 { greater + smaller } else { greater - smaller };
    if sum == 0 {
        return 0;
    }
    let shift = sum.leading_zeros();
    rounded(a & SIGN, above + 1 - shift as i32, sum << shift)
}

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

/// Returns whether `a` or `b` is NaN.
#[inline(always)]
#[must_use]
pub const fn unordered(a: u32, b: u32) -> bool {
    is_nan(a) || is_nan(b)
}

/// Returns whether `a` == `b`; false where one of them is NaN.
#[inline(always)]
#[must_use]
pub const fn equal(a: u32, b: u32) -> bool {
    if a == b { !is_nan(a) } else { is_zero(a | b) }
}

/// Returns whether `a` < `b`; false where one of them is NaN.
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

/// Returns whether `a` <= `b`; false where one of them is NaN.
#[inline(always)]
#[must_use]
pub const fn less_or_equal(a: u32, b: u32) -> bool {
    if ((a | b) as i32) >= 0 {
        return a <= b && b <= INFINITY;
    }
    let less = if ((a & b) as i32) < 0 { a >= b } else { a as i32 <= b as i32 };
    (less || is_zero(a | b)) && !unordered(a, b)
}
