//! Legs that ended, in bounded memory: a run with a page may last for days.

use std::collections::VecDeque;

use crate::summary::Leg;

/// Number of legs at the begin of a run that are kept.
pub(super) const FIRST: usize = 100;

/// Number of legs at the end of a run that are kept.
pub(super) const LAST: usize = 900;

/// Legs that ended, in their order. Of a long run the first and the last ones are kept, and all are
/// counted.
#[derive(Debug, Default)]
pub(in crate::run) struct EndedLegs {
    first: Vec<Leg>,
    last: VecDeque<Leg>,
    count: usize,
    reached: usize,
}

impl EndedLegs {
    /// Adds a leg.
    pub(super) fn push(&mut self, leg: Leg) {
        self.count += 1;
        self.reached += usize::from(leg.reached);
        if self.first.len() < FIRST {
            self.first.push(leg);
            return;
        }
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        self.last.push_back(leg);
    }

    /// Returns the number of all legs.
    pub(in crate::run) fn count(&self) -> usize {
        self.count
    }

    /// Returns the number of all legs whose targets were reached.
    pub(in crate::run) fn reached(&self) -> usize {
        self.reached
    }

    /// Returns the legs that were kept.
    pub(in crate::run) fn into_kept(self) -> Vec<Leg> {
        self.first.into_iter().chain(self.last).collect()
    }
}
