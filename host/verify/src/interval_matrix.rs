//! Interval matrices: the families of Jacobians that law `interval` is configured with, and the
//! arithmetic of vectors and 3 × 3 matrices of intervals.

use plumb_protocol::{AXES, MOTORS, PerAxis, PerMotor};

use super::branch_and_bound::relative_width;
use crate::Interval;
use crate::branch_and_bound::{Patch, minimise_over_directions};

/// Relative width of the enclosure of min |v|.
const TOLERANCE: f64 = 0.05;

/// Number of patches after which the search ends. The enclosure is valid at any time, but wider
/// before convergence.
const MAX_PATCHES: usize = 2_000_000;

/// All matrices whose entries lie in these intervals: rows x, y, z, columns A, B, C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntervalMatrix(pub PerAxis<PerMotor<Interval>>);

impl IntervalMatrix {
    /// Returns the matrices with the sign pattern (12) and α <= |J_ik| <= β (13).
    #[must_use]
    pub fn with_signs(alpha: f64, beta: f64) -> Self {
        let (plus, minus) = (Interval::new(alpha, beta), Interval::new(-beta, -alpha));
        Self([[minus, minus, plus], [minus, plus, Interval::point(0.0)], [minus; MOTORS]])
    }

    /// Checks that no member is singular.
    ///
    /// The determinant is linear in each entry, so that its extremes are at corners of the box. It
    /// has no zero if it has the same sign at all corners.
    #[must_use]
    pub fn is_nonsingular(&self) -> bool {
        let determinants: Vec<_> = (0..512)
            .map(|k| determinant(&self.vertex(k).map(|r| r.map(Interval::point))))
            .collect();
        determinants.iter().all(|d| d.lo > 0.0) || determinants.iter().all(|d| d.hi < 0.0)
    }

    /// Returns the corners of the box, by rows; 512 if no interval is a point.
    #[must_use]
    pub fn vertices(&self) -> Vec<PerAxis<PerMotor<f64>>> {
        let narrow: u32 = (0..AXES * MOTORS)
            .filter(|n| self.0[n / MOTORS][n % MOTORS].width() == 0.0)
            .map(|n| 1 << n)
            .sum();
        (0..512).filter(|corner| corner & narrow == 0).map(|corner| self.vertex(corner)).collect()
    }

    /// Returns the corner with the upper bounds where `bits` are set, row by row.
    fn vertex(&self, bits: u32) -> PerAxis<PerMotor<f64>> {
        let end = |n: usize| {
            let entry = self.0[n / MOTORS][n % MOTORS];
            if bits >> n & 1 == 0 { entry.lo } else { entry.hi }
        };
        std::array::from_fn(|i| std::array::from_fn(|k| end(MOTORS * i + k)))
    }

    /// Returns v(e), eqs. (7) and (8): for each column, the number nearest to zero in the interval
    /// of e'J. v has the unit of e.
    #[must_use]
    pub fn v(&self, e: PerAxis<f64>) -> PerMotor<f64> {
        std::array::from_fn(|k| {
            let ends: PerAxis<_> =
                std::array::from_fn(|i| [e[i] * self.0[i][k].lo, e[i] * self.0[i][k].hi]);
            let lower: f64 = ends.iter().map(|[a, b]| a.min(*b)).sum();
            let upper: f64 = ends.iter().map(|[a, b]| a.max(*b)).sum();
            lower.max(0.0) + upper.min(0.0)
        })
    }

    /// Returns an enclosure of the minimum of |v|/|e| over all e. The lower bound is proved, the
    /// upper bound is reached.
    ///
    /// With u̇ = -γ v, e'Jv >= |v|² implies |e| <= |e(0)| exp(-γ lo² t) for every J of the
    /// family.
    #[must_use]
    pub fn min_v(&self) -> Interval {
        let enclosure = |patch: &Patch| {
            let (e, centre) = (patch.e(), patch.centre());
            let column = |k: usize| std::array::from_fn(|i| self.0[i][k]);
            let v: Vector = std::array::from_fn(|k| dot(e, column(k)).magnitude());
            let reached =
                norm(self.v(centre).map(Interval::point)) / norm(centre.map(Interval::point));
            let lower = norm(v.map(|v| Interval::point(v.lo))) / norm(e);
            Interval::new(lower.lo.max(0.0), reached.hi)
        };
        minimise_over_directions(enclosure, relative_width(TOLERANCE), MAX_PATCHES)
            .map_or(Interval::point(0.0), |minimum| minimum.value)
    }
}

/// A vector with an entry for each axis, or for each motor: they are as many.
type Vector = PerAxis<Interval>;

/// Returns |x|.
pub(super) fn norm(x: Vector) -> Interval {
    (x[0].square() + x[1].square() + x[2].square()).sqrt()
}

/// Returns x · y.
pub(super) fn dot(x: Vector, y: Vector) -> Interval {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// Returns the determinant of a matrix by rows.
pub(super) fn determinant(m: &PerAxis<PerMotor<Interval>>) -> Interval {
    let minor = |r: usize, s: usize| m[1][r] * m[2][s] - m[1][s] * m[2][r];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the sign pattern with an interval of both signs in place of its zero.
    fn without_zero(alpha: f64, beta: f64, bound: f64) -> IntervalMatrix {
        let mut family = IntervalMatrix::with_signs(alpha, beta);
        family.0[1][2] = Interval::new(-bound, bound);
        family
    }

    /// Proposition 1: the pattern (12) is never singular. It may be singular with an entry in place
    /// of its zero.
    #[test]
    fn the_sign_pattern_is_never_singular() {
        assert!(
            IntervalMatrix::with_signs(0.005, 0.5).is_nonsingular()
                && IntervalMatrix::with_signs(1e-6, 1e3).is_nonsingular()
        );
        assert!(
            !without_zero(0.005, 0.5, 0.1).is_nonsingular()
                && without_zero(0.3, 0.5, 0.1).is_nonsingular()
        );
        assert!(!IntervalMatrix::with_signs(-0.01, 0.5).is_nonsingular());
    }

    /// Theorem 1: v(e) = 0 for some e other than 0 if and only if the family has a singular member.
    #[test]
    fn v_vanishes_if_a_member_is_singular() {
        let nonsingular = without_zero(0.3, 0.5, 0.1).min_v();
        assert!(nonsingular.lo > 0.0, "{nonsingular:?}");
        assert!(nonsingular.width() <= 0.06 * nonsingular.lo, "{nonsingular:?}");
        assert_eq!(without_zero(0.005, 0.5, 0.1).min_v().lo, 0.0);
    }

    #[test]
    fn a_point_interval_adds_no_corner() {
        assert_eq!(IntervalMatrix::with_signs(0.1, 0.2).vertices().len(), 256);
        assert_eq!(
            IntervalMatrix::with_signs(0.1, 0.1).vertices(),
            [[[-0.1, -0.1, 0.1], [-0.1, 0.1, 0.0], [-0.1; 3]]]
        );
    }
}
