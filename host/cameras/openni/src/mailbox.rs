//! Between the thread that talks to the library and who wants its pictures.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What to do with a letter when there is no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Overflow {
    /// The oldest of its kind makes room: of a live camera only now counts. There is room for so
    /// many of each kind.
    Drop,
    /// It waits: a recording is read whole.
    Block,
}

/// Kinds of letters. No letter pushes out one of another kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// What is waited for.
    Content,
    /// News of what was lost.
    Problem,
    /// The last letter.
    End,
}

/// Something to put into a [`Mailbox`].
pub(crate) trait Letter {
    /// Its kind.
    fn kind(&self) -> Kind;
}

/// A queue with room for a few letters.
#[derive(Debug)]
pub(crate) struct Mailbox<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    room: usize,
    overflow: Overflow,
}

#[derive(Debug)]
struct State<T> {
    letters: VecDeque<T>,
    closed: bool,
}

impl<T: Letter> Mailbox<T> {
    pub(crate) fn new(room: usize, overflow: Overflow) -> Self {
        let state = State { letters: VecDeque::with_capacity(room), closed: false };
        Self { state: Mutex::new(state), changed: Condvar::new(), room, overflow }
    }

    /// Puts a letter in; `false` where nobody reads it any more.
    pub(crate) fn put(&self, letter: T) -> bool {
        let mut state = self.lock();
        while self.overflow == Overflow::Block && state.letters.len() >= self.room && !state.closed
        {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        let kind = letter.kind();
        if state.letters.iter().filter(|other| other.kind() == kind).count() >= self.room
            && let Some(oldest) = state.letters.iter().position(|other| other.kind() == kind)
        {
            state.letters.remove(oldest);
        }
        state.letters.push_back(letter);
        self.changed.notify_all();
        !state.closed
    }

    /// The oldest letter; `None` where none comes within `timeout`.
    pub(crate) fn take(&self, timeout: Duration) -> Option<T> {
        let deadline = Instant::now() + timeout;
        let mut state = self.lock();
        loop {
            if let Some(letter) = state.letters.pop_front() {
                self.changed.notify_all();
                return Some(letter);
            }
            let left = deadline.checked_duration_since(Instant::now())?;
            (state, _) =
                self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner);
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

    impl Letter for u32 {
        /// Numbers from 100 are problems, those from 200 ends.
        fn kind(&self) -> Kind {
            match *self {
                0..100 => Kind::Content,
                100..200 => Kind::Problem,
                _ => Kind::End,
            }
        }
    }

    /// What is in a mailbox of a live camera with room for one after these letters.
    fn left(letters: &[u32]) -> Vec<u32> {
        let mailbox = Mailbox::new(1, Overflow::Drop);
        for letter in letters {
            assert!(mailbox.put(*letter));
        }
        std::iter::from_fn(|| mailbox.take(Duration::ZERO)).collect()
    }

    #[test]
    fn a_problem_never_pushes_out_a_picture() {
        assert_eq!(left(&[1, 100]), [1, 100]);
        assert_eq!(left(&[100, 1, 101, 102]), [1, 102]);
        assert_eq!(left(&[1, 100, 2]), [100, 2]);
        assert_eq!(left(&[1, 100, 2, 101, 200]), [2, 101, 200]);
    }

    #[test]
    fn of_a_live_camera_the_newest_stays() {
        let mailbox = Mailbox::new(2, Overflow::Drop);
        for letter in 0..5 {
            assert!(mailbox.put(letter));
        }
        assert_eq!(mailbox.take(Duration::ZERO), Some(3));
        assert_eq!(mailbox.take(Duration::ZERO), Some(4));
        assert_eq!(mailbox.take(Duration::ZERO), None);
    }

    #[test]
    fn a_recording_comes_whole_however_slowly_it_is_read() {
        let mailbox = Mailbox::new(2, Overflow::Block);
        std::thread::scope(|scope| {
            scope.spawn(|| (0..100).for_each(|letter| assert!(mailbox.put(letter))));
            for letter in 0..100 {
                assert_eq!(mailbox.take(Duration::from_secs(60)), Some(letter));
            }
        });
    }

    #[test]
    fn closing_frees_who_waits_for_room() {
        let mailbox = Mailbox::new(1, Overflow::Block);
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
