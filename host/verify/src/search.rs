//! Best-first bisection: the least value of a function over cells that can be split.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::Interval;

/// Where the least value is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Least<C> {
    /// It is not below `lo`, whatever the rest of the search would have found, and not above `hi`.
    pub(super) value: Interval,
    /// The cell that was looked at last.
    pub(super) cell: C,
    /// How many were looked at.
    pub(super) cells: usize,
}

/// Splits, with `halves`, the cell with the lowest bound until the least value over it is `known`
/// well enough, or until `most_cells` were looked at. `value` encloses the least value over a cell.
/// `None` where no cell is left.
pub(super) fn least<C>(
    start: Vec<C>,
    mut value: impl FnMut(&C) -> Interval,
    halves: impl Fn(&C) -> Vec<C>,
    known: impl Fn(Interval) -> bool,
    most_cells: usize,
) -> Option<Least<C>> {
    let mut heap: BinaryHeap<_> = start.into_iter().map(|cell| Entry(value(&cell), cell)).collect();
    let mut cells = 0;
    while let Some(Entry(bound, cell)) = heap.pop() {
        cells += 1;
        if known(bound) || cells >= most_cells {
            return Some(Least { value: bound, cell, cells });
        }
        heap.extend(halves(&cell).into_iter().map(|half| Entry(value(&half), half)));
    }
    None
}

/// Whether `value` is known to the part `tolerance` of itself.
pub(super) fn within(tolerance: f64) -> impl Fn(Interval) -> bool {
    move |value| value.width() <= tolerance * value.lo.abs()
}

/// A cell; the one whose bound is lowest is the greatest entry.
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
