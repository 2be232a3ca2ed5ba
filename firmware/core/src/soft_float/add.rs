//! Addition.

use super::{
    HIDDEN, INFINITY, NAN, SIGN, exponent, is_infinite, is_nan, is_zero, parts, rounded, shifted,
};

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
