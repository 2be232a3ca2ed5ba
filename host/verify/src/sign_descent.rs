//! Whether law `sign` decreases |e| on every rig of a family, and how fast: sym(J Σ⁻¹) > μ, by
//! branch and bound.
//!
//! The law is u̇ = -g Σ⁻¹ e, so that d|e|/dt <= -g μ |e| + |ṙ| for a target with the velocity ṙ.
//! The error is at most |ṙ| / (g μ) in the end.

use super::{Interval, RigFamily};
use crate::rig_family::Cell;

/// Relative sizes of a cell's sides (w, t, λ_A, λ_C, h/D) that count as equal when one is split.
const SPLIT_SCALES: [f64; 5] = [3.0, 1.0, 1.0, 1.0, 1.0];

/// Side below which a cell without a positive definite matrix is a counterexample. A larger cell
/// may contain no rig of the family.
const COUNTEREXAMPLE_SIDE: f64 = 1e-3;

/// Number of steps of μ from 0 to 1 in [`sign_decay`].
const DECAY_STEPS: u32 = 100;

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
    descent(rigs, 0.0, max_cells)
}

/// Returns the largest μ of 0.01, 0.02, ... with sym(J Σ⁻¹) > μ on every rig of the family, as far
/// as that is proved in at most `max_cells` cells for each; 0 where it is not proved for 0.01.
#[must_use]
pub fn sign_decay(rigs: &RigFamily, max_cells: usize) -> f64 {
    let decay = |steps: u32| f64::from(steps) / f64::from(DECAY_STEPS);
    let (mut proved, mut open) = (0, DECAY_STEPS);
    while open - proved > 1 {
        let middle = (proved + open) / 2;
        match descent(rigs, decay(middle), max_cells) {
            Descent::Proved(_) => proved = middle,
            Descent::Refuted(_) | Descent::Undecided(_) => open = middle,
        }
    }
    decay(proved)
}

/// Checks that sym(J Σ⁻¹) > `decay` on every rig of the family.
fn descent(rigs: &RigFamily, decay: f64, max_cells: usize) -> Descent {
    let mut open = vec![Cell::whole(rigs)];
    let mut cells = 0;
    while let Some(cell) = open.pop() {
        cells += 1;
        match is_positive_definite(symmetric_part(&cell, rigs, decay)) {
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

/// Returns B + B' for B = 4 (J Σ⁻¹ - `decay`): entries xx, yy, zz, xy, xz, yz.
///
/// Rows and columns are scaled with 1, 1 and √h, which preserves definiteness.
fn symmetric_part(cell: &Cell, rigs: &RigFamily, decay: f64) -> [Interval; 6] {
    let g = cell.geometry(rigs.min_lambda);
    let [a, b, c] = g.lengths;
    let [la, lb, lc] = g.lambda;
    let one = Interval::point(1.0);
    let (ta, tb) = (g.t * a, (one - g.t) * b);
    let root = g.h.sqrt();
    let shift = 8.0 * Interval::point(decay);
    let xx = 2.0 * ((ta + tb + 2.0 * c) / g.w) - shift;
    let yy = 4.0 * (a + b) - shift;
    let zz = 2.0 * (la * a + lb * b + 2.0 * (lc * c)) - shift * g.h;
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
    use nalgebra::{Matrix3, Point3};
    use plumb_emulator::plant::Geometry;
    use plumb_protocol::{PerAxis, PerMotor};

    use super::*;

    /// Motors of the paper's rig, metres.
    const MOTORS: PerMotor<PerAxis<f64>> =
        [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]];

    /// docs/understand/proofs.md claims descent from h = 0.1 m on. That takes six seconds, so that
    /// `plumb-lab verify --wide` checks it, and this test starts at 0.2 m.
    #[test]
    fn law_sign_descends_on_the_wide_family_and_on_the_papers_rig() {
        let wide = RigFamily::wide(0.2);
        assert!(matches!(sign_descent(&wide, 5_000_000), Descent::Proved(_)));
        let paper = RigFamily::around(&MOTORS, 0.0, 0.0, Interval::new(0.1, 0.665)).unwrap();
        assert!(matches!(sign_descent(&paper, 100_000), Descent::Proved(_)));
        assert_eq!(sign_decay(&paper, 100), 0.0);
        assert_eq!(sign_descent(&wide, 10), Descent::Undecided(10));
    }

    /// Compares the decay with the least eigenvalue of sym(-J Σ⁻¹) at places of the emulated rig.
    #[test]
    fn the_decay_of_law_sign_is_that_of_the_emulated_rig() {
        let family = RigFamily::around(&MOTORS, 0.0, 0.1, Interval::new(0.2, 0.5)).unwrap();
        let geometry = Geometry::new(MOTORS.map(Point3::from), [0.015; 3]).unwrap();
        // -Σ⁻¹ for cables that are let out, as the law has it.
        let direction = Matrix3::new(1.0, 2.0, 1.0, 1.0, -2.0, 1.0, -2.0, 0.0, 2.0) / 4.0;
        let mut least = f64::INFINITY;
        for (p, q, r) in (0..9 * 9 * 4).map(|n| (n % 9, n / 9 % 9, n / 81)) {
            // Parts of A, C and B, each at least 0.1.
            let [a, c] = [p, q].map(|part| 0.1 + 0.7 * f64::from(part) / 8.0);
            let b = 1.0 - a - c;
            if b < 0.1 - 1e-9 {
                continue;
            }
            let at = |i: usize| a * MOTORS[0][i] + b * MOTORS[1][i] + c * MOTORS[2][i];
            let ball = Point3::new(at(0), at(1), at(2) - 0.2 - 0.1 * f64::from(r));
            let motion = -geometry.jacobian(&ball).unwrap() * direction;
            let symmetric = 0.5 * (motion + motion.transpose());
            least = least.min(symmetric.symmetric_eigenvalues().min());
        }
        let decay = sign_decay(&family, 100_000);
        assert!((decay..decay + 0.02).contains(&least), "{least}, at least {decay}");
    }

    #[test]
    fn law_sign_does_not_descend_close_below_the_motors() {
        let close = RigFamily { below: Interval::new(0.02, 0.021), ..RigFamily::wide(0.02) };
        let found = sign_descent(&close, 5_000_000);
        assert!(matches!(found, Descent::Refuted(_)), "{found:?}");
    }
}
