//! The law of signs is stable for every Jacobian with the sign pattern: the Routh-Hurwitz
//! conditions of J Σ⁻¹, exactly.

use super::polynomial::Polynomial;

type Signs = [[i8; 3]; 3];
type Matrix = [[Polynomial; 3]; 3];

/// How many monomials, all of them positive, each condition is a sum of.
///
/// With B = |det Σ| J Σ⁻¹ (= 4 J Σ⁻¹), whose characteristic polynomial is s³ - tr s² + E₂ s - det:
/// all eigenvalues have positive real parts where tr, det and tr E₂ - det are positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RouthHurwitz {
    /// tr B.
    pub trace: usize,
    /// E₂, the sum of the principal minors of two rows.
    pub minors: usize,
    /// det B.
    pub determinant: usize,
    /// tr B E₂ - det B.
    pub difference: usize,
}

/// The conditions for all J with the signs `jacobian`, driven with the inverse of `law`: expanded
/// in the nine magnitudes |J_ik| with whole coefficients. `None` where `law` is singular, or where
/// a condition has a monomial that is not positive.
#[must_use]
pub fn routh_hurwitz(jacobian: Signs, law: Signs) -> Option<RouthHurwitz> {
    let b = product(jacobian, inverse(law)?);
    let trace = b[0][0].clone() + &b[1][1] + &b[2][2];
    let minor = |i: usize, k: usize| &b[i][i] * &b[k][k] - &(&b[i][k] * &b[k][i]);
    let minors = minor(0, 1) + &minor(0, 2) + &minor(1, 2);
    let cofactor = |r: usize, s: usize| &b[1][r] * &b[2][s] - &(&b[1][s] * &b[2][r]);
    let determinant =
        &b[0][0] * &cofactor(1, 2) - &(&b[0][1] * &cofactor(0, 2)) + &(&b[0][2] * &cofactor(0, 1));
    let difference = &trace * &minors - &determinant;
    Some(RouthHurwitz {
        trace: trace.positive_monomials()?,
        minors: minors.positive_monomials()?,
        determinant: determinant.positive_monomials()?,
        difference: difference.positive_monomials()?,
    })
}

/// |det Σ| Σ⁻¹, which is whole; `None` where Σ is singular.
fn inverse(signs: Signs) -> Option<[[i64; 3]; 3]> {
    let s = signs.map(|row| row.map(i64::from));
    let next = |i: usize, by: usize| (i + by) % 3;
    let cofactor = |i: usize, k: usize| {
        s[next(i, 1)][next(k, 1)] * s[next(i, 2)][next(k, 2)]
            - s[next(i, 1)][next(k, 2)] * s[next(i, 2)][next(k, 1)]
    };
    let determinant: i64 = (0..3).map(|k| s[0][k] * cofactor(0, k)).sum();
    (determinant != 0)
        .then(|| [0, 1, 2].map(|i| [0, 1, 2].map(|k| determinant.signum() * cofactor(k, i))))
}

/// J times `right`, where J_ik = σ_ik |J_ik|.
fn product(signs: Signs, right: [[i64; 3]; 3]) -> Matrix {
    let entry = |i: usize, j: usize| {
        (0..3).fold(Polynomial::default(), |sum, k| {
            sum + &Polynomial::magnitude(i, k, i64::from(signs[i][k]) * right[k][j])
        })
    };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

#[cfg(test)]
mod tests {
    use plumb_protocol::config::SIGNS;

    use super::*;

    #[test]
    fn the_law_of_signs_meets_them_with_positive_monomials_only() {
        let expected = RouthHurwitz { trace: 8, minors: 12, determinant: 4, difference: 72 };
        assert_eq!(routh_hurwitz(SIGNS, SIGNS), Some(expected));
        // The matrix that the board has: u̇ = -g Σ⁻¹ e, docs/understand/sign.md.
        assert_eq!(inverse(SIGNS), Some([[-1, -2, -1], [-1, 2, -1], [2, 0, -2]]));
    }

    /// With another sign anywhere in the law's Σ, or with a Jacobian that has another sign, it is
    /// not so any more.
    #[test]
    fn with_another_sign_anywhere_they_are_not_met() {
        for (i, k) in (0..9).map(|n| (n / 3, n % 3)) {
            for sign in [-1, 0, 1].into_iter().filter(|sign| *sign != SIGNS[i][k]) {
                let mut other = SIGNS;
                other[i][k] = sign;
                assert_eq!(routh_hurwitz(SIGNS, other), None, "law with {sign} at {i}, {k}");
                // A zero is the limit of both signs, and is no other sign.
                assert!(
                    sign == 0 || routh_hurwitz(other, SIGNS).is_none(),
                    "J with {sign} at {i}, {k}"
                );
            }
        }
    }
}
