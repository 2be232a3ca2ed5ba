//! Whether the law of signs lets |e| fall on every rig of a kind: sym(J Σ⁻¹) > 0, by branch and
//! bound.

use super::rigs::Cell;
use super::{Interval, Rigs};

/// What came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Descent {
    /// It holds for all of them; proved in so many cells.
    Holds(usize),
    /// In one of the cells it does not.
    Fails(usize),
    /// Not decided in so many cells.
    Open(usize),
}

/// Decides it in at most `most_cells`.
#[must_use]
pub fn sign_descent(rigs: &Rigs, most_cells: usize) -> Descent {
    let whole = Cell::whole(rigs);
    let sizes = [3.0, 1.0, 1.0, 1.0, 1.0];
    let mut open = vec![whole];
    let mut cells = 0;
    while let Some(cell) = open.pop() {
        cells += 1;
        match positive(symmetric(&cell, rigs)) {
            Some(true) => continue,
            Some(false) if cell.0.iter().all(|side| side.width() < 1e-3) => {
                return Descent::Fails(cells);
            }
            _ if cells >= most_cells => return Descent::Open(cells),
            _ => {
                open.extend(cell.halves(sizes).into_iter().filter(|half| half.contains_some(rigs)))
            }
        }
    }
    Descent::Holds(cells)
}

/// B + B' for B = 4 J Σ⁻¹, its rows and columns scaled with 1, 1 and √h, which leaves definiteness
/// as it is: entries xx, yy, zz, xy, xz, yz.
fn symmetric(cell: &Cell, rigs: &Rigs) -> [Interval; 6] {
    let s = cell.shape(rigs.least_lambda);
    let [a, b, c] = s.lengths;
    let [la, lb, lc] = s.lambda;
    let one = Interval::point(1.0);
    let (ta, tb) = (s.t * a, (one - s.t) * b);
    let root = s.h.sqrt();
    let xx = 2.0 * ((ta + tb + 2.0 * c) / s.w);
    let yy = 4.0 * (a + b);
    let zz = 2.0 * (la * a + lb * b + 2.0 * (lc * c));
    let xy = 2.0 * ((ta - tb) / s.w) + (a - b);
    let xz = (ta + tb - 2.0 * c) / s.w * root + (la * a + lb * b - 2.0 * (lc * c)) / root;
    let yz = (a - b) * root + 2.0 * ((la * a - lb * b) / root);
    [xx, yy, zz, xy, xz, yz]
}

/// Whether all matrices are positive definite (Sylvester); `Some(false)` where none is.
fn positive([xx, yy, zz, xy, xz, yz]: [Interval; 6]) -> Option<bool> {
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

    /// docs/understand/proofs.md has it from 0.1 m on, which takes six seconds: `plumb verify` does
    /// that.
    #[test]
    fn the_law_of_signs_descends_where_it_is_said_to() {
        assert!(matches!(sign_descent(&Rigs::wide(0.2), 5_000_000), Descent::Holds(_)));
        let motors = [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]];
        let paper = Rigs::around(&motors, 0.0, 0.0, Interval::new(0.1, 0.665)).unwrap();
        assert!(matches!(sign_descent(&paper, 100_000), Descent::Holds(_)));
        assert_eq!(sign_descent(&Rigs::wide(0.2), 10), Descent::Open(10));
    }

    /// Close below the motors it does not.
    #[test]
    fn it_does_not_close_below_the_motors() {
        let close = Rigs { below: Interval::new(0.02, 0.021), ..Rigs::wide(0.02) };
        assert!(
            matches!(sign_descent(&close, 5_000_000), Descent::Fails(_)),
            "{:?}",
            sign_descent(&close, 5_000_000)
        );
    }
}
