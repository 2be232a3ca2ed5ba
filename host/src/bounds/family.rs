//! Families of Jacobians: their bounds over a kind of rigs, and whether one of them is singular.

use super::{Cell, Interval, Rigs};

/// Bounds are told to this part of themselves.
const TOLERANCE: f64 = 0.005;

/// Cells after which the bounds are told as they are: safe, but loose.
const MOST_CELLS: usize = 2_000_000;

/// |J_ik| over a cell; J_yC is 0.
fn magnitudes(cell: &Cell, rigs: &Rigs) -> [[Interval; 3]; 3] {
    let s = cell.shape(rigs);
    let one = Interval::point(1.0);
    let [a, b, c] = s.lengths;
    [
        [s.t * a / s.w, (one - s.t) * b / s.w, c / s.w],
        [a, b, Interval::point(0.0)],
        [s.lambda[0] * a / s.h, s.lambda[1] * b / s.h, s.lambda[2] * c / s.h],
    ]
}

/// α and β: safe bounds on the least and the largest of the entries of |J| that are not zero, over all `rigs`.
#[must_use]
pub fn jacobian_bounds(rigs: &Rigs) -> (f64, f64) {
    (bound(rigs, least).max(0.0), -bound(rigs, |m| -greatest(m)))
}

fn entries(m: &[[Interval; 3]; 3]) -> impl Iterator<Item = Interval> + '_ {
    m.iter()
        .enumerate()
        .flat_map(|(i, row)| row.iter().enumerate().filter(move |(k, _)| (i, *k) != (1, 2)).map(|(_, v)| *v))
}

fn least(m: &[[Interval; 3]; 3]) -> Interval {
    entries(m).fold(Interval::point(f64::INFINITY), |l, v| Interval::new(l.lo.min(v.lo), l.hi.min(v.hi)))
}

fn greatest(m: &[[Interval; 3]; 3]) -> Interval {
    entries(m).fold(Interval::point(0.0), |l, v| Interval::new(l.lo.max(v.lo), l.hi.max(v.hi)))
}

/// A safe lower bound on the least value of `f` over all rigs, by best-first bisection.
fn bound(rigs: &Rigs, f: impl Fn(&[[Interval; 3]; 3]) -> Interval) -> f64 {
    let whole = Cell::whole(rigs);
    let sizes = whole.0.map(|side| side.width().max(1e-9));
    let value = |cell: &Cell| f(&magnitudes(cell, rigs));
    let mut heap = std::collections::BinaryHeap::from([Entry(value(&whole), whole)]);
    let mut cells = 0;
    while let Some(Entry(v, cell)) = heap.pop() {
        cells += 1;
        if v.hi - v.lo <= TOLERANCE * v.lo.abs() || cells > MOST_CELLS {
            return v.lo;
        }
        heap.extend(
            cell.halves(sizes)
                .into_iter()
                .filter(|half| half.contains_some(rigs))
                .map(|half| Entry(value(&half), half)),
        );
    }
    f64::INFINITY
}

/// A cell in the order of what is least in it.
struct Entry(Interval, Cell);

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.0.lo == other.0.lo
    }
}

impl Eq for Entry {}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.0.lo.total_cmp(&self.0.lo)
    }
}

/// Whether no matrix of the family is singular: the determinant is linear in each entry for itself, so that its least and
/// greatest values are at corners of the box; all corners must have one sign. Rows x, y, z; columns A, B, C.
#[must_use]
pub fn nonsingular(family: &[[Interval; 3]; 3]) -> bool {
    let corner = |bits: u32| -> Interval {
        let entry = |i: usize, k: usize| {
            let v = family[i][k];
            Interval::point(if bits >> (3 * i + k) & 1 == 0 { v.lo } else { v.hi })
        };
        let minor = |r: usize, s: usize| entry(1, r) * entry(2, s) - entry(1, s) * entry(2, r);
        entry(0, 0) * minor(1, 2) - entry(0, 1) * minor(0, 2) + entry(0, 2) * minor(0, 1)
    };
    (0..512).all(|bits| corner(bits).lo > 0.0) || (0..512).all(|bits| corner(bits).hi < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// docs/control.md: 30, 42, 79, 181 for λ >= 0.10, 0.05, 0.023, 0.01.
    #[test]
    fn the_papers_rig_has_the_ratios_of_the_control_notes() {
        for (lambda, ratio) in [(0.10, 30.0), (0.05, 42.0), (0.023, 79.0), (0.01, 181.0)] {
            let (alpha, beta) = jacobian_bounds(&Rigs::paper(lambda));
            assert!(
                (beta / alpha / ratio - 1.0).abs() < 0.1,
                "λ >= {lambda}: {alpha} to {beta}, {}",
                beta / alpha
            );
        }
    }

    fn family(alpha: f64, beta: f64, askew: f64) -> [[Interval; 3]; 3] {
        let (plus, minus) = (Interval::new(alpha, beta), Interval::new(-beta, -alpha));
        [[minus, minus, plus], [minus, plus, Interval::new(-askew, askew)], [minus, minus, minus]]
    }

    /// Proposition 1: the pattern (12) is never singular. With an entry in the place of its zero it may be.
    #[test]
    fn the_sign_pattern_is_never_singular() {
        assert!(nonsingular(&family(0.005, 0.5, 0.0)) && nonsingular(&family(1e-6, 1e3, 0.0)));
        assert!(!nonsingular(&family(0.005, 0.5, 0.1)) && nonsingular(&family(0.3, 0.5, 0.1)));
        assert!(!nonsingular(&family(-0.01, 0.5, 0.0)));
    }
}
