//! Best-first branch and bound: the minimum of a function over cells that can be split.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::Interval;

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
