//! Interval families of Jacobians, of which law `interval` is told one.

use super::Interval;
use super::directions::{Patch, determinant, dot, norm, over_directions};
use super::search::within;

/// The least |v| is told to this part of itself.
const TOLERANCE: f64 = 0.05;

/// Patches of directions after which it is told as it is: safe, but loose.
const MOST_PATCHES: usize = 2_000_000;

/// Every matrix whose entries lie in these intervals: rows x, y, z, columns A, B, C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Family(pub [[Interval; 3]; 3]);

impl Family {
    /// The sign pattern (12) with α <= |J_ik| <= β (13).
    #[must_use]
    pub fn of_signs(alpha: f64, beta: f64) -> Self {
        let (plus, minus) = (Interval::new(alpha, beta), Interval::new(-beta, -alpha));
        Self([[minus, minus, plus], [minus, plus, Interval::point(0.0)], [minus; 3]])
    }

    /// Whether none of them is singular: the determinant is linear in each entry for itself, so
    /// that its least and greatest values are at corners of the box; all corners must have one
    /// sign.
    #[must_use]
    pub fn nonsingular(&self) -> bool {
        let determinants: Vec<_> = (0..512)
            .map(|k| determinant(&self.vertex(k).map(|r| r.map(Interval::point))))
            .collect();
        determinants.iter().all(|d| d.lo > 0.0) || determinants.iter().all(|d| d.hi < 0.0)
    }

    /// The corners of the box, by rows; where all nine intervals have a width, 512.
    #[must_use]
    pub fn vertices(&self) -> Vec<[[f64; 3]; 3]> {
        let narrow: u32 =
            (0..9).filter(|n| self.0[n / 3][n % 3].width() == 0.0).map(|n| 1 << n).sum();
        (0..512).filter(|corner| corner & narrow == 0).map(|corner| self.vertex(corner)).collect()
    }

    /// The corner with the upper ends where `bits` are set, row by row.
    fn vertex(&self, bits: u32) -> [[f64; 3]; 3] {
        let end = |n: usize| {
            let entry = self.0[n / 3][n % 3];
            if bits >> n & 1 == 0 { entry.lo } else { entry.hi }
        };
        [0, 3, 6].map(|row| [row, row + 1, row + 2].map(end))
    }

    /// v of eqs. (7), (8) for the error `e`: per column what of the interval of e'J is nearest to
    /// zero.
    #[must_use]
    pub fn v(&self, e: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| {
            let ends = [0, 1, 2].map(|i| [e[i] * self.0[i][k].lo, e[i] * self.0[i][k].hi]);
            let least: f64 = ends.iter().map(|[a, b]| a.min(*b)).sum();
            let most: f64 = ends.iter().map(|[a, b]| a.max(*b)).sum();
            least.max(0.0) + most.min(0.0)
        })
    }

    /// The least |v|/|e| over all e, within which it is: the lower end is proved, the upper one is
    /// reached. With u̇ = -γ v, e'Jv >= |v|² lets |e| fall at least as exp(-γ lo² t), whatever J of
    /// the family is the true one.
    #[must_use]
    pub fn least_v(&self) -> Interval {
        let value = |patch: &Patch| {
            let (e, centre) = (patch.e(), patch.centre());
            let v = [0, 1, 2].map(|k| dot(e, [0, 1, 2].map(|i| self.0[i][k])).magnitude());
            let reached =
                norm(self.v(centre).map(Interval::point)) / norm(centre.map(Interval::point));
            let lowest = norm(v.map(|v| Interval::point(v.lo))) / norm(e);
            Interval::new(lowest.lo.max(0.0), reached.hi)
        };
        over_directions(value, within(TOLERANCE), MOST_PATCHES)
            .map_or(Interval::point(0.0), |least| least.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn askew(alpha: f64, beta: f64, askew: f64) -> Family {
        let mut family = Family::of_signs(alpha, beta);
        family.0[1][2] = Interval::new(-askew, askew);
        family
    }

    /// Proposition 1: the pattern (12) is never singular. With an entry in the place of its zero it
    /// may be.
    #[test]
    fn the_sign_pattern_is_never_singular() {
        assert!(
            Family::of_signs(0.005, 0.5).nonsingular() && Family::of_signs(1e-6, 1e3).nonsingular()
        );
        assert!(!askew(0.005, 0.5, 0.1).nonsingular() && askew(0.3, 0.5, 0.1).nonsingular());
        assert!(!Family::of_signs(-0.01, 0.5).nonsingular());
    }

    /// Theorem 1: v is 0 for some e other than 0 exactly where a matrix of the family is singular.
    #[test]
    fn v_vanishes_where_a_matrix_is_singular() {
        let sound = askew(0.3, 0.5, 0.1).least_v();
        assert!(sound.lo > 0.0 && sound.width() <= 0.06 * sound.lo, "{sound:?}");
        assert_eq!(askew(0.005, 0.5, 0.1).least_v().lo, 0.0);
    }

    #[test]
    fn intervals_without_width_have_one_corner() {
        assert_eq!(Family::of_signs(0.1, 0.2).vertices().len(), 256);
        assert_eq!(
            Family::of_signs(0.1, 0.1).vertices(),
            [[[-0.1, -0.1, 0.1], [-0.1, 0.1, 0.0], [-0.1; 3]]]
        );
    }
}
