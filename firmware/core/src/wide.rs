//! Products and quotients of 64 bits for a chip that multiplies and divides 32 bits. The compiler's
//! own take it hundreds of clocks.

/// Returns the product of two numbers, from the products of their halves.
pub(crate) fn product(a: u32, b: u32) -> u64 {
    let ([high_a, low_a], [high_b, low_b]) = (halves(a), halves(b));
    let part = |a: u32, b: u32| u64::from(a.wrapping_mul(b));
    let cross = part(high_a, low_b).wrapping_add(part(low_a, high_b));
    (part(high_a, high_b) << 32).wrapping_add(cross << 16).wrapping_add(part(low_a, low_b))
}

/// Returns the product of two signed numbers.
pub(crate) fn signed_product(a: i32, b: i32) -> i64 {
    let size = product(a.unsigned_abs(), b.unsigned_abs()) as i64;
    if (a < 0) == (b < 0) { size } else { -size }
}

/// Returns a function that scales numbers (up to 2^31) by `least`/`whole`, rounded down. `least` is
/// below `whole`, which is up to 2^31. One division serves all numbers.
pub(crate) fn scale_by_ratio(least: u32, whole: u32) -> impl Fn(u32) -> u32 {
    // The ratio in Q32. Shifting both numbers takes less time than a shift of 64 bits.
    let shift = whole.leading_zeros();
    let (least_shifted, divisor) = (least << shift, whole << shift);
    let (high, rest) = digit(least_shifted, 0, divisor);
    let ratio = high << 16 | digit(rest, 0, divisor).0;
    move |number| {
        // The ratio is too small by less than 2^-32, so the guess is right or one too small, and
        // the remainder is below twice `whole`.
        let about = (product(number, ratio) >> 32) as u32;
        let left = number.wrapping_mul(least).wrapping_sub(about.wrapping_mul(whole));
        if left >= whole { about.wrapping_add(1) } else { about }
    }
}

/// Returns `dividend / divisor`, rounded down, where that fits 32 bits. It divides half by half
/// (Knuth, The Art of Computer Programming, 4.3.1, algorithm D).
pub(crate) fn quotient(dividend: u64, divisor: u32) -> u32 {
    // With the divisor's highest bit set, a guess from its upper half is at most two too large.
    let shift = divisor.leading_zeros();
    let (divisor, dividend) = (divisor << shift, dividend << shift);
    let [upper, lower] = halves(dividend as u32);
    let (high, rest) = digit((dividend >> 32) as u32, upper, divisor);
    let (low, _) = digit(rest, lower, divisor);
    high << 16 | low
}

/// Divides `rest` (below `divisor`) with the 16 bits `next` behind it. Returns 16 bits of quotient,
/// and the remainder.
fn digit(rest: u32, next: u32, divisor: u32) -> (u32, u32) {
    let [upper, lower] = halves(divisor);
    let (mut guess, mut left) = (rest / upper, rest % upper);
    while guess > 0xffff || guess.wrapping_mul(lower) > (left << 16 | next) {
        (guess, left) = (guess - 1, left + upper);
        if left > 0xffff {
            break;
        }
    }
    (guess, (rest << 16 | next).wrapping_sub(guess.wrapping_mul(divisor)))
}

/// Returns the upper and the lower 16 bits.
const fn halves(number: u32) -> [u32; 2] {
    [number >> 16, number & 0xffff]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Draws numbers of every size.
    fn numbers() -> impl Strategy<Value = u32> {
        (any::<u32>(), 0u32..32).prop_map(|(number, shift)| number >> shift)
    }

    proptest! {
        #[test]
        fn a_product_is_exact(a in numbers(), b in numbers()) {
            prop_assert_eq!(product(a, b), u64::from(a) * u64::from(b));
        }

        #[test]
        fn a_signed_product_is_exact(a: i32, b: i32) {
            prop_assert_eq!(signed_product(a, b), i64::from(a) * i64::from(b));
        }

        #[test]
        fn a_scaled_number_is_exact(
            number in 0u32..=1 << 31,
            whole in 1u32..=1 << 31,
            share in 0.0f64..1.0,
            shifts in proptest::array::uniform2(0u32..32),
        ) {
            let whole = (whole >> shifts[0]).max(1);
            let (number, least) = (number >> shifts[1], (f64::from(whole) * share) as u32);
            let exact = u64::from(number) * u64::from(least) / u64::from(whole);
            prop_assert_eq!(u64::from(scale_by_ratio(least, whole)(number)), exact);
            // A ratio that divides evenly.
            prop_assert_eq!(scale_by_ratio(least, whole)(whole), least);
        }

        #[test]
        fn a_quotient_is_exact(divisor in 1u32.., whole in numbers(), part in 0.0f64..1.0) {
            let rest = (f64::from(divisor) * part) as u64;
            let dividend = u64::from(divisor) * u64::from(whole) + rest;
            prop_assert_eq!(u64::from(quotient(dividend, divisor)), dividend / u64::from(divisor));
        }
    }
}
