//! Whether law `sign` decreases |e| on every rig of a family: sym(J Σ⁻¹) > 0, by branch and
//! bound.

use super::geometry::Cell;
use super::{Interval, RigFamily};

/// Relative sizes of a cell's sides (w, t, λ_A, λ_C, h/D) that count as equal when one is split.
const SPLIT_SCALES: [f64; 5] = [3.0, 1.0, 1.0, 1.0, 1.0];

/// Side below which a cell without a positive definite matrix is a counterexample. A larger cell
/// may contain no rig of the family.
const COUNTEREXAMPLE_SIDE: f64 = 1e-3;

/// Result of [`sign_descent`], each with the number of cells visited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Descent {
    /// |e| decreases on every rig of the family.
    Proved(usize),
    /// |e| does not decrease on the rigs of one cell.
    Refuted(usize),
    /// The limit of cells was reached first.
    Undecided(usize),
}

/// Checks that law `sign` decreases |e| on every rig of the family, in at most `max_cells` cells.
#[must_use]
pub fn sign_descent(rigs: &RigFamily, max_cells: usize) -> Descent {
    let mut open = vec![Cell::whole(rigs)];
    let mut cells = 0;
    while let Some(cell) = open.pop() {
        cells += 1;
        match is_positive_definite(symmetric_part(&cell, rigs)) {
            Some(true) => continue,
            Some(false) if cell.0.iter().all(|side| side.width() < COUNTEREXAMPLE_SIDE) => {
                return Descent::Refuted(cells);
            }
            _ if cells >= max_cells => return Descent::Undecided(cells),
            _ => {
                let halves = cell.halves(SPLIT_SCALES).into_iter();
                open.extend(halves.filter(|half| half.may_intersect(rigs)));
            }
        }
    }
    Descent::Proved(cells)
}

/// Returns B + B' for B = 4 J Σ⁻¹: entries xx, yy, zz, xy, xz, yz.
///
/// Rows and columns are scaled with 1, 1 and √h, which preserves definiteness.
fn symmetric_part(cell: &Cell, rigs: &RigFamily) -> [Interval; 6] {
    let g = cell.geometry(rigs.min_lambda);
    let [a, b, c] = g.lengths;
    let [la, lb, lc] = g.lambda;
    let one = Interval::point(1.0);
    let (ta, tb) = (g.t * a, (one - g.t) * b);
    let root = g.h.sqrt();
    let xx = 2.0 * ((ta + tb + 2.0 * c) / g.w);
    let yy = 4.0 * (a + b);
    let zz = 2.0 * (la * a + lb * b + 2.0 * (lc * c));
    let xy = 2.0 * ((ta - tb) / g.w) + (a - b);
    let xz = (ta + tb - 2.0 * c) / g.w * root + (la * a + lb * b - 2.0 * (lc * c)) / root;
    let yz = (a - b) * root + 2.0 * ((la * a - lb * b) / root);
    [xx, yy, zz, xy, xz, yz]
}

/// Returns `Some(true)` if all matrices are positive definite (Sylvester's criterion),
/// `Some(false)` if none is, `None` otherwise.
fn is_positive_definite([xx, yy, zz, xy, xz, yz]: [Interval; 6]) -> Option<bool> {
    let minor = xx * yy - xy.square();
    // det = zz minor - (xx yz² - 2 xy xz yz + yy xz²)
    let det = zz * minor - (xx * yz.square() + yy * xz.square() - 2.0 * (xy * xz * yz));
    if xx.lo > 0.0 && minor.lo > 0.0 && det.lo > 0.0 {
        Some(true)
    } else if xx.hi <= 0.0 || minor.hi <= 0.0 || det.hi <= 0.0 {
        Some(false)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// docs/understand/proofs.md claims descent from h = 0.1 m on. That takes six seconds, so that
    /// `plumb verify --wide` checks it, and this test starts at 0.2 m.
    #[test]
    fn law_sign_descends_on_the_wide_family_and_on_the_papers_rig() {
        let wide = RigFamily::wide(0.2);
        assert!(matches!(sign_descent(&wide, 5_000_000), Descent::Proved(_)));
        let motors = [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]];
        let paper = RigFamily::around(&motors, 0.0, 0.0, Interval::new(0.1, 0.665)).unwrap();
        assert!(matches!(sign_descent(&paper, 100_000), Descent::Proved(_)));
        assert_eq!(sign_descent(&wide, 10), Descent::Undecided(10));
    }

    #[test]
    fn law_sign_does_not_descend_close_below_the_motors() {
        let close = RigFamily { below: Interval::new(0.02, 0.021), ..RigFamily::wide(0.02) };
        let found = sign_descent(&close, 5_000_000);
        assert!(matches!(found, Descent::Refuted(_)), "{found:?}");
    }
}
