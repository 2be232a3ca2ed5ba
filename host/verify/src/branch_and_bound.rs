//! Best-first branch and bound: the minimum of a function over cells that can be split, or over all
//! directions of the error e.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use plumb_protocol::{AXES, PerAxis};

use crate::Interval;

/// Result of a minimisation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum<C> {
    /// Enclosure of the minimum: `lo` is a lower bound over all cells, `hi` is reached.
    pub(super) value: Interval,
    /// The cell with the lowest bound.
    pub(super) cell: C,
    /// Number of cells visited.
    pub(super) cells: usize,
}

/// Minimises a function over the cells `start`.
///
/// `enclosure` encloses the function's minimum over a cell. Each step splits the cell with the
/// lowest bound with `halves`. The search ends when the enclosure of the minimum has `converged`,
/// or after `max_cells` cells. Returns `None` if no cell is left.
pub(super) fn minimise<C>(
    start: Vec<C>,
    mut enclosure: impl FnMut(&C) -> Interval,
    halves: impl Fn(&C) -> Vec<C>,
    converged: impl Fn(Interval) -> bool,
    max_cells: usize,
) -> Option<Minimum<C>> {
    let mut heap: BinaryHeap<_> =
        start.into_iter().map(|cell| Entry(enclosure(&cell), cell)).collect();
    let mut cells = 0;
    while let Some(Entry(value, cell)) = heap.pop() {
        cells += 1;
        if converged(value) || cells >= max_cells {
            return Some(Minimum { value, cell, cells });
        }
        heap.extend(halves(&cell).into_iter().map(|half| Entry(enclosure(&half), half)));
    }
    None
}

/// Returns a check that an enclosure is at most `tolerance` times its lower bound wide.
pub(super) fn relative_width(tolerance: f64) -> impl Fn(Interval) -> bool {
    move |value| value.width() <= tolerance * value.lo.abs()
}

/// A cell and its enclosure. The greatest entry is the cell with the lowest bound.
struct Entry<C>(Interval, C);

impl<C> PartialEq for Entry<C> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<C> Eq for Entry<C> {}

impl<C> PartialOrd for Entry<C> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<C> Ord for Entry<C> {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.lo.total_cmp(&self.0.lo).then(other.0.hi.total_cmp(&self.0.hi))
    }
}

/// A rectangle on a face of the cube |e|∞ = 1.
///
/// Three faces cover all directions, because v(-e) = -v(e).
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    face: usize,
    sides: [Interval; 2],
}

impl Patch {
    /// Returns the three faces.
    fn faces() -> Vec<Self> {
        let side = Interval::new(-1.0, 1.0);
        (0..AXES).map(|face| Self { face, sides: [side; 2] }).collect()
    }

    /// Splits the patch across its wider side.
    fn halves(&self) -> Vec<Self> {
        let wider = usize::from(self.sides[1].width() > self.sides[0].width());
        let with = |half| {
            let mut patch = *self;
            patch.sides[wider] = half;
            patch
        };
        self.sides[wider].halves().map(with).to_vec()
    }

    /// Returns the vector with `one` in the face's coordinate and `sides` in the other two.
    fn at<T: Copy>(&self, one: T, sides: [T; 2]) -> PerAxis<T> {
        let mut e = [one; AXES];
        e[(self.face + 1) % AXES] = sides[0];
        e[(self.face + 2) % AXES] = sides[1];
        e
    }

    /// Returns the box that contains every e of the patch.
    pub(super) fn e(&self) -> PerAxis<Interval> {
        self.at(Interval::point(1.0), self.sides)
    }

    /// Returns the e at the midpoint.
    pub(super) fn centre(&self) -> PerAxis<f64> {
        self.at(1.0, self.sides.map(Interval::midpoint))
    }
}

/// Minimises a function over all directions of e; see [`minimise`].
pub(super) fn minimise_over_directions(
    enclosure: impl FnMut(&Patch) -> Interval,
    converged: impl Fn(Interval) -> bool,
    max_patches: usize,
) -> Option<Minimum<Patch>> {
    minimise(Patch::faces(), enclosure, Patch::halves, converged, max_patches)
}
