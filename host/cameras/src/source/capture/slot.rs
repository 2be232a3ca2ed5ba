//! Place for the newest frame, between the thread of a source and the reader of its frames.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::Wake;
use std::time::{Duration, Instant};

use plumb_frame::frame::RgbdFrame;

use super::super::error::SourceError;

/// Number of errors that may wait. The source waits when there are as many: a source that fails at
/// once, again and again, does not fill the memory.
const MAX_LOST: usize = 30;

/// Item that a source delivers.
#[derive(Debug)]
pub(super) enum Item {
    /// A frame.
    Frame(RgbdFrame),
    /// The loss of a frame.
    Lost(SourceError),
    /// The end of the source, with its cause where it failed.
    End(Option<SourceError>),
}

/// Queue of at most one frame, and of errors in order with it.
#[derive(Debug, Default)]
pub(super) struct Slot {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    items: VecDeque<Item>,
    /// Number of frames that a newer one replaced.
    skipped: u64,
    /// Whether the wait of the reader must end.
    is_woken: bool,
    /// Whether the reader takes no more items.
    is_closed: bool,
    /// Whether the source is closed.
    has_ended: bool,
}

/// Guard that marks the end of the thread, also when it panics.
pub(super) struct EndGuard<'a>(&'a Slot);

impl Slot {
    /// Adds an item; a frame replaces the one that waits. Returns whether the reader takes more.
    pub(super) fn add(&self, item: Item) -> bool {
        let mut state = self.lock();
        while state.items.len() >= MAX_LOST && !state.is_closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if matches!(item, Item::Frame(_)) {
            let count = state.items.len();
            state.items.retain(|item| !matches!(item, Item::Frame(_)));
            state.skipped += (count - state.items.len()) as u64;
        }
        state.items.push_back(item);
        self.changed.notify_all();
        !state.is_closed
    }

    /// Removes and returns the oldest item.
    pub(super) fn take(&self) -> Option<Item> {
        let item = self.lock().items.pop_front();
        self.changed.notify_all();
        item
    }

    /// Waits for an item or a wake-up, for `limit` at most. Returns whether there is an item.
    pub(super) fn wait(&self, limit: Duration) -> bool {
        let mut state = self.wait_until(limit, |state| !state.items.is_empty() || state.is_woken);
        state.is_woken = false;
        !state.items.is_empty()
    }

    /// Waits until the source is closed, for `limit` at most. Returns whether it is.
    pub(super) fn wait_for_end(&self, limit: Duration) -> bool {
        self.wait_until(limit, |state| state.has_ended).has_ended
    }

    /// Returns the number of frames that a newer one replaced.
    pub(super) fn skipped(&self) -> u64 {
        self.lock().skipped
    }

    /// Requests the end of the thread: its items are not taken any more.
    pub(super) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// Returns a guard that marks the source as closed when it is dropped.
    pub(super) fn end_guard(&self) -> EndGuard<'_> {
        EndGuard(self)
    }

    fn wait_until(&self, limit: Duration, done: impl Fn(&State) -> bool) -> MutexGuard<'_, State> {
        let begin = Instant::now();
        let mut state = self.lock();
        while !done(&state) {
            let left = limit.saturating_sub(begin.elapsed());
            if left.is_zero() {
                break;
            }
            (state, _) =
                self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner);
        }
        state
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Wake for Slot {
    fn wake(self: Arc<Self>) {
        self.lock().is_woken = true;
        self.changed.notify_all();
    }
}

impl Drop for EndGuard<'_> {
    fn drop(&mut self) {
        self.0.lock().has_ended = true;
        self.0.changed.notify_all();
    }
}
