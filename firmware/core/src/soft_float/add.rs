//! Sums.

use super::{
    HIDDEN, INFINITY, NAN, SIGN, exponent, is_infinite, is_nan, is_zero, leading_zeros, parts,
    rounded, shifted,
};

/// The highest bit of a significand with 7 bits below its last.
const TOP: u32 = HIDDEN << 7;

/// `a` + `b`.
#[inline(always)]
#[must_use]
pub fn add(a: u32, b: u32) -> u32 {
    // Twice the same code, as nothing has to change places then.
    if a << 1 < b << 1 { add_lesser(b, a) } else { add_lesser(a, b) }
}

/// `a` + `b`, |a| >= |b|.
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
    // What is shifted out decides only where the rest is half way.
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

/// The nearest number to `sum`, the lowest `BELOW` bits of which are to go: 7 where it has the
/// exponent of `a`. Of `a` + `b`, where that is half way between two.
#[inline(always)]
fn packed<const BELOW: u32>(a: u32, b: u32, sum: u32) -> u32 {
    let up = sum.wrapping_add(1 << (BELOW - 1));
    if up << (32 - BELOW) == 0 {
        return half_way::<BELOW>(a, b, up);
    }
    with_exponent::<BELOW>(a, up >> BELOW)
}

/// The same where what is left of the sum is half a unit: to even, unless something of `b` was
/// lost.
#[inline(never)]
fn half_way<const BELOW: u32>(a: u32, b: u32, up: u32) -> u32 {
    if exponent(a).wrapping_sub(exponent(b)) > 7 {
        add_any(a, b)
    } else {
        with_exponent::<BELOW>(a, up >> BELOW & !1)
    }
}

/// A significand, to the exponent of which its hidden bit is added, and a carry.
#[inline(always)]
fn with_exponent<const BELOW: u32>(a: u32, significand: u32) -> u32 {
    ((a >> 23).wrapping_add(BELOW).wrapping_sub(8) << 23).wrapping_add(significand)
}

/// `a` less another, where `difference` has lost bits at its upper end and nothing is left to be
/// rounded: the two were of about one size.
#[inline(never)]
fn cancelled(a: u32, difference: u32) -> u32 {
    if difference == 0 {
        return 0;
    }
    let highest = (a >> 23).wrapping_sub(1);
    // A subnormal has no hidden bit, and the same exponent as the least that has.
    let shift = (leading_zeros(difference).wrapping_sub(1)).min(highest & 0xff);
    (highest.wrapping_sub(shift) << 23).wrapping_add(difference.wrapping_shl(shift) >> 7)
}

/// `a` + `b`, |a| >= |b|, whatever they are.
#[inline(never)]
fn add_any(a: u32, b: u32) -> u32 {
    if is_zero(b) && !is_nan(a) {
        // -0 + -0 is -0, and 0 of other signs 0.
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
    let shift = leading_zeros(sum);
    rounded(a & SIGN, above + 1 - shift as i32, sum << shift)
}
