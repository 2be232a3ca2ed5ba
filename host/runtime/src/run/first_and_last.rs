//! A list in bounded memory: a run with a page may last for days.

use std::collections::VecDeque;

/// Number of items at the start that are kept.
const FIRST: usize = 100;

/// Number of items at the end that are kept.
const LAST: usize = 900;

/// A list of which the first and the last items are kept, and all are counted.
#[derive(Debug)]
pub(super) struct FirstAndLast<T> {
    first: Vec<T>,
    last: VecDeque<T>,
    count: usize,
}

impl<T> Default for FirstAndLast<T> {
    fn default() -> Self {
        Self { first: Vec::new(), last: VecDeque::new(), count: 0 }
    }
}

impl<T> FirstAndLast<T> {
    /// Adds an item at the end.
    pub(super) fn push(&mut self, item: T) {
        self.count += 1;
        if self.first.len() < FIRST {
            self.first.push(item);
            return;
        }
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        self.last.push_back(item);
    }

    /// Returns the number of all items.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Returns the number of items that are left out.
    pub(super) fn left_out(&self) -> u64 {
        (self.count - self.first.len() - self.last.len()) as u64
    }

    /// Returns the items that were kept, in their order.
    pub(super) fn into_kept(self) -> Vec<T> {
        self.first.into_iter().chain(self.last).collect()
    }
}
