//! Polynomials with integer coefficients in the nine magnitudes |J_ik|, expanded exactly, and the
//! Routh-Hurwitz conditions of J Σ⁻¹ by them: law `sign` is stable for every Jacobian with the sign
//! pattern.

use std::collections::BTreeMap;
use std::ops::{Add, Mul, Sub};

use plumb_protocol::{AXES, MOTORS, PerAxis, PerMotor};
use serde::Serialize;

/// Exponents of the |J_ik|, row by row.
type Exponents = [u8; AXES * MOTORS];

/// A sum of monomials. No stored coefficient is 0.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Polynomial(BTreeMap<Exponents, i64>);

impl Polynomial {
    /// Returns `coefficient` times |J_ik|.
    pub(super) fn magnitude(i: usize, k: usize, coefficient: i64) -> Self {
        let mut exponents = [0; AXES * MOTORS];
        exponents[MOTORS * i + k] = 1;
        Self::default() + &Self(BTreeMap::from([(exponents, coefficient)]))
    }

    /// Returns the number of monomials if all coefficients are positive. The polynomial is then
    /// positive for all positive magnitudes. Returns `None` otherwise.
    pub(super) fn positive_monomials(&self) -> Option<usize> {
        (!self.0.is_empty() && self.0.values().all(|c| *c > 0)).then_some(self.0.len())
    }

    fn add_monomial(&mut self, exponents: Exponents, coefficient: i64) {
        let sum = self.0.entry(exponents).or_insert(0);
        *sum += coefficient;
        if *sum == 0 {
            self.0.remove(&exponents);
        }
    }
}

/// Returns the exponents of the product of two monomials.
fn add_exponents(a: &Exponents, b: &Exponents) -> Exponents {
    std::array::from_fn(|n| a[n] + b[n])
}

impl Add<&Polynomial> for Polynomial {
    type Output = Self;
    fn add(mut self, other: &Self) -> Self {
        other.0.iter().for_each(|(exponents, c)| self.add_monomial(*exponents, *c));
        self
    }
}

impl Sub<&Polynomial> for Polynomial {
    type Output = Self;
    fn sub(mut self, other: &Self) -> Self {
        other.0.iter().for_each(|(exponents, c)| self.add_monomial(*exponents, -c));
        self
    }
}

impl Mul for &Polynomial {
    type Output = Polynomial;
    fn mul(self, other: Self) -> Polynomial {
        let mut product = Polynomial::default();
        for (a, c) in &self.0 {
            for (b, d) in &other.0 {
                product.add_monomial(add_exponents(a, b), c * d);
            }
        }
        product
    }
}

type Signs = PerAxis<PerMotor<i8>>;
type Matrix = PerAxis<PerAxis<Polynomial>>;

/// Number of monomials of each Routh-Hurwitz condition; all of them have positive coefficients.
///
/// The characteristic polynomial of B = |det Σ| J Σ⁻¹ (= 4 J Σ⁻¹) is
/// s³ - tr s² + E₂ s - det. All eigenvalues have positive real parts if tr, det
/// and tr E₂ - det are positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RouthHurwitz {
    /// tr B.
    pub trace: usize,
    /// E₂, the sum of the principal 2 × 2 minors of B.
    pub minors: usize,
    /// det B.
    pub determinant: usize,
    /// tr B E₂ - det B.
    pub difference: usize,
}

/// Checks the Routh-Hurwitz conditions of J Σ⁻¹ for every J with the signs `jacobian`, where Σ
/// is `law`. The conditions are expanded in the nine magnitudes |J_ik| with integer coefficients.
///
/// Returns `None` if `law` is singular, or if a monomial of a condition has a negative coefficient.
#[must_use]
pub fn routh_hurwitz(jacobian: Signs, law: Signs) -> Option<RouthHurwitz> {
    let b = product(jacobian, scaled_inverse(law)?);
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

/// Returns |det Σ| Σ⁻¹, whose entries are integers; `None` if Σ is singular.
fn scaled_inverse(signs: Signs) -> Option<PerMotor<PerAxis<i64>>> {
    let s = signs.map(|row| row.map(i64::from));
    let next = |i: usize, by: usize| (i + by) % 3;
    let cofactor = |i: usize, k: usize| {
        s[next(i, 1)][next(k, 1)] * s[next(i, 2)][next(k, 2)]
            - s[next(i, 1)][next(k, 2)] * s[next(i, 2)][next(k, 1)]
    };
    let determinant: i64 = (0..MOTORS).map(|k| s[0][k] * cofactor(0, k)).sum();
    let entry = |i: usize, k: usize| determinant.signum() * cofactor(k, i);
    (determinant != 0).then(|| std::array::from_fn(|i| std::array::from_fn(|k| entry(i, k))))
}

/// Returns J times `right`, where J_ik = σ_ik |J_ik|.
fn product(signs: Signs, right: PerMotor<PerAxis<i64>>) -> Matrix {
    let entry = |i: usize, j: usize| {
        (0..MOTORS).fold(Polynomial::default(), |sum, k| {
            sum + &Polynomial::magnitude(i, k, i64::from(signs[i][k]) * right[k][j])
        })
    };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

#[cfg(test)]
mod tests {
    use plumb_protocol::config::SIGNS;

    use super::*;

    /// (a + 2b)(a - 2b) = a² - 4b².
    #[test]
    fn products_are_expanded_and_cancelled_terms_removed() {
        let (a, b) = (Polynomial::magnitude(0, 0, 1), Polynomial::magnitude(0, 1, 2));
        let product = &(a.clone() + &b) * &(a.clone() - &b);
        assert_eq!(product, &a * &a - &(&b * &b));
        assert_eq!(product.0.len(), 2);
        assert_eq!(product.positive_monomials(), None);
        assert_eq!((a.clone() - &a).positive_monomials(), None);
        assert_eq!((&(a.clone() + &b) * &(a + &b)).positive_monomials(), Some(3));
    }

    #[test]
    fn law_sign_meets_the_conditions_with_positive_monomials_only() {
        let expected = RouthHurwitz { trace: 8, minors: 12, determinant: 4, difference: 72 };
        assert_eq!(routh_hurwitz(SIGNS, SIGNS), Some(expected));
        // The board's matrix: u̇ = -g Σ⁻¹ e, docs/understand/sign.md.
        assert_eq!(scaled_inverse(SIGNS), Some([[-1, -2, -1], [-1, 2, -1], [2, 0, -2]]));
    }

    /// Any other sign in the law's Σ, or in the Jacobian, violates a condition.
    #[test]
    fn another_sign_anywhere_violates_a_condition() {
        for (i, k) in (0..9).map(|n| (n / 3, n % 3)) {
            for sign in [-1, 0, 1].into_iter().filter(|sign| *sign != SIGNS[i][k]) {
                let mut other = SIGNS;
                other[i][k] = sign;
                assert_eq!(routh_hurwitz(SIGNS, other), None, "law with {sign} at {i}, {k}");
                // A zero in J is the limit of both signs, so the conditions may hold.
                assert!(
                    sign == 0 || routh_hurwitz(other, SIGNS).is_none(),
                    "J with {sign} at {i}, {k}"
                );
            }
        }
    }
}
