//! Bounded queue between the worker thread and the reader of its messages, and these messages.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::error::OpenniError;
use crate::picture::Pair;
use crate::settings::Opened;

/// Behaviour of a full mailbox.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Overflow {
    /// The oldest message of the same kind is dropped: of a live camera only the newest counts. The
    /// capacity is per kind.
    Drop,
    /// The sender waits: a recording is read completely.
    Block,
}

/// Kind of a message. A message never displaces one of another kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MessageKind {
    /// A result.
    Content,
    /// A loss.
    Problem,
    /// The last message.
    End,
}

/// Message of a [`Mailbox`].
pub(crate) trait Message {
    /// Returns the kind of the message.
    fn kind(&self) -> MessageKind;
}

/// Queue with a capacity of a few messages.
#[derive(Debug)]
pub(crate) struct Mailbox<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    capacity: usize,
    overflow: Overflow,
}

#[derive(Debug)]
struct State<T> {
    messages: VecDeque<T>,
    closed: bool,
}

impl<T: Message> Mailbox<T> {
    /// Makes an empty mailbox.
    pub(crate) fn new(capacity: usize, overflow: Overflow) -> Self {
        let state = State { messages: VecDeque::with_capacity(capacity), closed: false };
        Self { state: Mutex::new(state), changed: Condvar::new(), capacity, overflow }
    }

    /// Adds a message. Returns `false` where the mailbox is closed.
    pub(crate) fn send(&self, message: T) -> bool {
        let mut state = self.lock();
        while self.overflow == Overflow::Block
            && state.messages.len() >= self.capacity
            && !state.closed
        {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        let kind = message.kind();
        let of_kind = state.messages.iter().filter(|other| other.kind() == kind).count();
        if of_kind >= self.capacity
            && let Some(oldest) = state.messages.iter().position(|other| other.kind() == kind)
        {
            state.messages.remove(oldest);
        }
        state.messages.push_back(message);
        self.changed.notify_all();
        !state.closed
    }

    /// Removes and returns the oldest message; `None` where none comes within `timeout`.
    pub(crate) fn receive(&self, timeout: Duration) -> Option<T> {
        let deadline = Instant::now() + timeout;
        let mut state = self.lock();
        loop {
            if let Some(message) = state.messages.pop_front() {
                self.changed.notify_all();
                return Some(message);
            }
            let left = deadline.checked_duration_since(Instant::now())?;
            (state, _) =
                self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Closes the mailbox: its messages are no longer received.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Returns whether the mailbox is closed.
    pub(crate) fn is_closed(&self) -> bool {
        self.lock().closed
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Message about an open camera.
#[derive(Debug)]
pub(crate) enum Event {
    /// The next pair of pictures.
    Pair(Pair),
    /// Pictures are lost. The camera goes on.
    Problem(OpenniError),
    /// The camera or recording is over: the last message.
    Over(Result<(), OpenniError>),
}

impl Message for Event {
    fn kind(&self) -> MessageKind {
        match self {
            Self::Pair(_) => MessageKind::Content,
            Self::Problem(_) => MessageKind::Problem,
            Self::Over(_) => MessageKind::End,
        }
    }
}

impl Message for Result<Opened, OpenniError> {
    fn kind(&self) -> MessageKind {
        MessageKind::Content
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Message for u32 {
        /// Numbers from 100 are problems, those from 200 ends.
        fn kind(&self) -> MessageKind {
            match *self {
                0..100 => MessageKind::Content,
                100..200 => MessageKind::Problem,
                _ => MessageKind::End,
            }
        }
    }

    /// Sends `messages` to a live camera's mailbox with a capacity of one. Returns what it holds.
    fn left(messages: &[u32]) -> Vec<u32> {
        let mailbox = Mailbox::new(1, Overflow::Drop);
        for message in messages {
            assert!(mailbox.send(*message));
        }
        std::iter::from_fn(|| mailbox.receive(Duration::ZERO)).collect()
    }

    #[test]
    fn a_problem_never_displaces_a_picture() {
        assert_eq!(left(&[1, 100]), [1, 100]);
        assert_eq!(left(&[100, 1, 101, 102]), [1, 102]);
        assert_eq!(left(&[1, 100, 2]), [100, 2]);
        assert_eq!(left(&[1, 100, 2, 101, 200]), [2, 101, 200]);
    }

    #[test]
    fn a_live_camera_keeps_the_newest() {
        let mailbox = Mailbox::new(2, Overflow::Drop);
        for message in 0..5 {
            assert!(mailbox.send(message));
        }
        assert_eq!(mailbox.receive(Duration::ZERO), Some(3));
        assert_eq!(mailbox.receive(Duration::ZERO), Some(4));
        assert_eq!(mailbox.receive(Duration::ZERO), None);
    }

    #[test]
    fn a_slow_reader_loses_nothing_of_a_recording() {
        let mailbox = Mailbox::new(2, Overflow::Block);
        std::thread::scope(|scope| {
            scope.spawn(|| (0..100).for_each(|message| assert!(mailbox.send(message))));
            for message in 0..100 {
                assert_eq!(mailbox.receive(Duration::from_secs(60)), Some(message));
            }
        });
    }

    #[test]
    fn closing_releases_a_waiting_sender() {
        let mailbox = Mailbox::new(1, Overflow::Block);
        std::thread::scope(|scope| {
            let writer = scope.spawn(|| mailbox.send(1) && mailbox.send(2));
            while mailbox.lock().messages.is_empty() {
                std::thread::yield_now();
            }
            mailbox.close();
            assert!(!writer.join().unwrap());
        });
    }
}
