//! Between the thread that talks to the library and who wants its pictures.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What to do with what comes when there is no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Full {
    /// The oldest makes room: of a live camera only now counts.
    Drop,
    /// It waits: a recording is read whole.
    Wait,
}

/// A queue with room for a few letters.
#[derive(Debug)]
pub(crate) struct Mailbox<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    room: usize,
    full: Full,
}

#[derive(Debug)]
struct State<T> {
    letters: VecDeque<T>,
    closed: bool,
}

impl<T> Mailbox<T> {
    pub(crate) fn new(room: usize, full: Full) -> Self {
        let state = State { letters: VecDeque::with_capacity(room), closed: false };
        Self { state: Mutex::new(state), changed: Condvar::new(), room, full }
    }

    /// Puts a letter in; `false` where nobody reads it any more.
    pub(crate) fn put(&self, letter: T) -> bool {
        let mut state = self.lock();
        while self.full == Full::Wait && state.letters.len() >= self.room && !state.closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.letters.len() >= self.room {
            state.letters.pop_front();
        }
        state.letters.push_back(letter);
        self.changed.notify_all();
        !state.closed
    }

    /// The oldest letter; `None` where none comes within `patience`.
    pub(crate) fn take(&self, patience: Duration) -> Option<T> {
        let deadline = Instant::now() + patience;
        let mut state = self.lock();
        loop {
            if let Some(letter) = state.letters.pop_front() {
                self.changed.notify_all();
                return Some(letter);
            }
            let left = deadline.checked_duration_since(Instant::now())?;
            (state, _) = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Nobody reads any more.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Whether nobody reads any more.
    pub(crate) fn is_closed(&self) -> bool {
        self.lock().closed
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_live_camera_the_newest_stays() {
        let mailbox = Mailbox::new(2, Full::Drop);
        for letter in 0..5 {
            assert!(mailbox.put(letter));
        }
        assert_eq!(mailbox.take(Duration::ZERO), Some(3));
        assert_eq!(mailbox.take(Duration::ZERO), Some(4));
        assert_eq!(mailbox.take(Duration::ZERO), None);
    }

    #[test]
    fn a_recording_comes_whole_however_slowly_it_is_read() {
        let mailbox = Mailbox::new(2, Full::Wait);
        std::thread::scope(|scope| {
            scope.spawn(|| (0..100).for_each(|letter| assert!(mailbox.put(letter))));
            for letter in 0..100 {
                assert_eq!(mailbox.take(Duration::from_secs(60)), Some(letter));
            }
        });
    }

    #[test]
    fn closing_frees_who_waits_for_room() {
        let mailbox = Mailbox::new(1, Full::Wait);
        std::thread::scope(|scope| {
            let writer = scope.spawn(|| mailbox.put(1) && mailbox.put(2));
            while mailbox.lock().letters.is_empty() {
                std::thread::yield_now();
            }
            mailbox.close();
            assert!(!writer.join().unwrap());
        });
    }
}
