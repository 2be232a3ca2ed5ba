//! Vectors and 3 × 3 matrices of intervals.

use super::Interval;

/// Returns |x|.
pub(super) fn norm(x: [Interval; 3]) -> Interval {
    (x[0].square() + x[1].square() + x[2].square()).sqrt()
}

/// Returns x · y.
pub(super) fn dot(x: [Interval; 3], y: [Interval; 3]) -> Interval {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// Returns the determinant of a matrix by rows.
pub(super) fn determinant(m: &[[Interval; 3]; 3]) -> Interval {
    let minor = |r: usize, s: usize| m[1][r] * m[2][s] - m[1][s] * m[2][r];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}
