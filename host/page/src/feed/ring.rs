//! Ring of the newest items.

use std::collections::VecDeque;

/// Ring of the newest items, numbered from 0 since the start.
pub(super) struct Numbered<T> {
    pub(super) items: VecDeque<T>,
    /// Number of the item that comes next.
    pub(super) next: u64,
}

impl<T> Default for Numbered<T> {
    fn default() -> Self {
        Self { items: VecDeque::new(), next: 0 }
    }
}

impl<T: Clone> Numbered<T> {
    /// Adds an item; of more than `capacity` the oldest one goes.
    pub(super) fn push(&mut self, item: T, capacity: usize) {
        if self.items.len() == capacity {
            self.items.pop_front();
        }
        self.items.push_back(item);
        self.next += 1;
    }

    /// Returns the items from number `from` on, and how many of those are gone.
    pub(super) fn since(&self, from: u64) -> (Vec<T>, u64) {
        let first = self.next - self.items.len() as u64;
        let skipped = from.saturating_sub(first) as usize;
        (self.items.iter().skip(skipped).cloned().collect(), first.saturating_sub(from))
    }
}
