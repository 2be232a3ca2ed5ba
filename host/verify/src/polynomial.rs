//! Polynomials with integer coefficients in the nine magnitudes |J_ik|, expanded exactly.

use std::collections::BTreeMap;
use std::ops::{Add, Mul, Sub};

/// Exponents of the |J_ik|, row by row.
type Exponents = [u8; 9];

/// A sum of monomials. No stored coefficient is 0.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Polynomial(BTreeMap<Exponents, i64>);

impl Polynomial {
    /// Returns `coefficient` times |J_ik|.
    pub(super) fn magnitude(i: usize, k: usize, coefficient: i64) -> Self {
        let mut exponents = [0; 9];
        exponents[3 * i + k] = 1;
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

#[cfg(test)]
mod tests {
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
}
