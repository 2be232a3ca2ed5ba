//! Place for the newest frame, between the thread that delivers frames and their reader.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::Wake;
use std::time::{Duration, Instant};

use plumb_frame::frame::RgbdFrame;
use plumb_frame::source::SourceError;

/// Number of errors that may wait. The source waits when there are as many: a source that fails at
/// once, again and again, does not fill the memory.
const MAX_LOST: usize = 30;

/// Item that a source delivers.
#[derive(Debug)]
pub(crate) enum Item<F = RgbdFrame> {
    /// A frame.
    Frame(F),
    /// The loss of a frame.
    Lost(SourceError),
    /// The end of the source, with its cause where it failed.
    End(Option<SourceError>),
}

/// Queue of at most one frame, and of errors in order with it.
#[derive(Debug)]
pub(crate) struct Slot<F = RgbdFrame> {
    state: Mutex<State<F>>,
    changed: Condvar,
}

#[derive(Debug)]
struct State<F> {
    items: VecDeque<Item<F>>,
    /// Number of frames that a newer one replaced here.
    skipped: u64,
    /// Number of frames that a newer one replaced before they came here.
    skipped_before: u64,
    /// Whether the wait of the reader must end.
    is_woken: bool,
    /// Whether the reader takes no more items.
    is_closed: bool,
    /// Whether the source is closed.
    has_ended: bool,
}

/// Guard that marks the end of the thread, also when it panics.
pub(crate) struct EndGuard<'a, F>(&'a Slot<F>);

impl<F> Default for Slot<F> {
    fn default() -> Self {
        let state = State {
            items: VecDeque::new(),
            skipped: 0,
            skipped_before: 0,
            is_woken: false,
            is_closed: false,
            has_ended: false,
        };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }
}

impl<F> Slot<F> {
    /// Adds an item; a frame replaces the one that waits. Returns whether the reader takes more.
    pub(crate) fn add(&self, item: Item<F>) -> bool {
        let mut state = self.lock();
        while state.items.len() >= MAX_LOST && !state.is_closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.push(item);
        self.changed.notify_all();
        !state.is_closed
    }

    /// Adds an item as [`add`](Self::add), without waiting: an error without room is dropped.
    pub(crate) fn offer(&self, item: Item<F>) -> bool {
        let mut state = self.lock();
        if state.items.len() < MAX_LOST || !matches!(item, Item::Lost(_)) {
            state.push(item);
            self.changed.notify_all();
        }
        !state.is_closed
    }

    /// Removes and returns the oldest item.
    pub(crate) fn take(&self) -> Option<Item<F>> {
        let item = self.lock().items.pop_front();
        self.changed.notify_all();
        item
    }

    /// Waits for an item or a wake-up, for `limit` at most. Returns whether there is an item.
    pub(crate) fn wait(&self, limit: Duration) -> bool {
        let mut state = self.wait_until(limit, |state| !state.items.is_empty() || state.is_woken);
        state.is_woken = false;
        !state.items.is_empty()
    }

    /// Waits until the source is closed, for `limit` at most. Returns whether it is.
    pub(crate) fn wait_for_end(&self, limit: Duration) -> bool {
        self.wait_until(limit, |state| state.has_ended).has_ended
    }

    /// Returns the number of frames that a newer one replaced, here or before.
    pub(crate) fn skipped(&self) -> u64 {
        let state = self.lock();
        state.skipped + state.skipped_before
    }

    /// Sets the number of frames that a newer one replaced before they came here.
    pub(super) fn set_skipped_before(&self, count: u64) {
        self.lock().skipped_before = count;
    }

    /// Returns whether the reader takes no more items.
    pub(crate) fn is_closed(&self) -> bool {
        self.lock().is_closed
    }

    /// Requests the end of the thread: its items are not taken any more.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// Returns a guard that marks the source as closed when it is dropped.
    pub(crate) fn end_guard(&self) -> EndGuard<'_, F> {
        EndGuard(self)
    }

    fn wait_until(
        &self,
        limit: Duration,
        done: impl Fn(&State<F>) -> bool,
    ) -> MutexGuard<'_, State<F>> {
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

    fn lock(&self) -> MutexGuard<'_, State<F>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<F> State<F> {
    /// Adds an item; a frame replaces the one that waits.
    fn push(&mut self, item: Item<F>) {
        if matches!(item, Item::Frame(_)) {
            let count = self.items.len();
            self.items.retain(|item| !matches!(item, Item::Frame(_)));
            self.skipped += (count - self.items.len()) as u64;
        }
        self.items.push_back(item);
    }
}

impl Wake for Slot {
    fn wake(self: Arc<Self>) {
        self.lock().is_woken = true;
        self.changed.notify_all();
    }
}

impl<F> Drop for EndGuard<'_, F> {
    fn drop(&mut self) {
        self.0.lock().has_ended = true;
        self.0.changed.notify_all();
    }
}
