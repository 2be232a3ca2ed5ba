//! Products and quotients of 64 bits for a chip that multiplies and divides 32: the compiler's own take it hundreds of clocks.

/// The product of two numbers, from those of their halves.
pub(crate) fn product(a: u32, b: u32) -> u64 {
    let ([high_a, low_a], [high_b, low_b]) = (halves(a), halves(b));
    let part = |a: u32, b: u32| u64::from(a.wrapping_mul(b));
    let cross = part(high_a, low_b).wrapping_add(part(low_a, high_b));
    (part(high_a, high_b) << 32).wrapping_add(cross << 16).wrapping_add(part(low_a, low_b))
}

/// `dividend / divisor`, rounded down, where that fits 32 bits: half by half (Knuth, The Art of Computer Programming, 4.3.1, D).
pub(crate) fn quotient(dividend: u64, divisor: u32) -> u32 {
    // The divisor's highest bit set, so that a guess from its upper half is at most two too much.
    let shift = divisor.leading_zeros();
    let (divisor, dividend) = (divisor << shift, dividend << shift);
    let [upper, lower] = halves(dividend as u32);
    let (high, rest) = digit((dividend >> 32) as u32, upper, divisor);
    let (low, _) = digit(rest, lower, divisor);
    high << 16 | low
}

/// A half of a quotient: of `rest` (below `divisor`) with 16 bits more behind it; and what is left.
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

/// The upper and the lower 16 bits.
const fn halves(number: u32) -> [u32; 2] {
    [number >> 16, number & 0xffff]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers of every size.
    fn numbers() -> impl Strategy<Value = u32> {
        (any::<u32>(), 0u32..32).prop_map(|(number, shift)| number >> shift)
    }

    proptest! {
        #[test]
        fn a_product_is_exact(a in numbers(), b in numbers()) {
            prop_assert_eq!(product(a, b), u64::from(a) * u64::from(b));
        }

        #[test]
        fn a_quotient_is_exact(divisor in 1u32.., whole in numbers(), part in 0.0f64..1.0) {
            let dividend = u64::from(divisor) * u64::from(whole) + (f64::from(divisor) * part) as u64;
            prop_assert_eq!(u64::from(quotient(dividend, divisor)), dividend / u64::from(divisor));
        }
    }
}
