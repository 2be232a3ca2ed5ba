//! A bounded queue and a thread between a run and an observer that writes.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use plumb_cameras::capture::panic_message;
use plumb_cameras::record::Overflow;
use plumb_frame::source::BoxedError;
use thiserror::Error;

use crate::observer::{EventRecord, FrameRecord, Observer};
use crate::summary::Summary;

/// Most events that wait for room: as many as the summary keeps.
const MAX_WAITING: usize = 1000;

/// Settings of the queue before an observer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueSettings {
    /// Name of the observer and its thread.
    pub name: &'static str,
    /// Number of records that may wait.
    pub capacity: usize,
    /// What to do with a record when the queue is full.
    pub overflow: Overflow,
    /// Whether the records keep their frames: 1.5 MB each at 640x480.
    pub with_frames: bool,
}

/// Failure of an observer behind a queue.
#[derive(Debug, Error)]
pub enum QueuedError {
    /// The observer reported a failure.
    #[error("the {name} has failed")]
    Observer {
        /// Name of the observer.
        name: &'static str,
        /// Cause.
        source: BoxedError,
    },
    /// The observer panicked. Everything after that is lost.
    #[error("the {name} has panicked: {message}")]
    Panicked {
        /// Name of the observer.
        name: &'static str,
        /// Message of the panic.
        message: String,
    },
}

/// Item of the queue.
enum Item {
    Frame(Box<FrameRecord>),
    Event(EventRecord),
    End(Box<Summary>),
}

/// Failure of the observer, from its thread to the run.
type Failure = Arc<Mutex<Option<BoxedError>>>;

/// Observer that runs in a thread of its own, behind a bounded queue.
///
/// With [`Overflow::Drop`] a slow observer never delays the run: a record for which there is no
/// room is dropped and counted. An event waits for room, and is received before the next record.
/// With [`Overflow::Block`] the run waits until the observer has handled the record, so that a
/// failure ends the run at the same frame every time.
///
/// Dropping it waits until the observer has received everything, also while the run panics.
pub struct BoundedObserver<O> {
    /// Beginning of the queue; `None` once it is closed or the observer panicked.
    items: Option<SyncSender<Item>>,
    /// Receives a message for each handled item with [`Overflow::Block`].
    handled: Receiver<()>,
    /// Events for which there was no room yet, the oldest first.
    waiting: VecDeque<EventRecord>,
    /// `None` once it is joined.
    thread: Option<JoinHandle<O>>,
    failure: Failure,
    /// Message of the panic that ended the thread.
    panicked: Option<String>,
    settings: QueueSettings,
    dropped: u64,
}

impl<O: Observer + Send + 'static> BoundedObserver<O> {
    /// Starts the thread of `observer`.
    ///
    /// # Errors
    /// Where the operating system starts no thread.
    pub fn new(observer: O, settings: QueueSettings) -> std::io::Result<Self> {
        let (items, incoming) = sync_channel(settings.capacity);
        let (done, handled) = channel();
        let done = (settings.overflow == Overflow::Block).then_some(done);
        let failure = Failure::default();
        let shared = Arc::clone(&failure);
        let thread = thread::Builder::new()
            .name(settings.name.to_owned())
            .spawn(move || serve(observer, &incoming, &shared, done.as_ref()))?;
        let (items, thread, panicked, dropped) = (Some(items), Some(thread), None, 0);
        let waiting = VecDeque::new();
        Ok(Self { items, handled, waiting, thread, failure, panicked, settings, dropped })
    }

    /// Waits until the observer has received everything. Returns it.
    ///
    /// # Errors
    /// A failure that [`Observer::failure`] has not returned yet; [`QueuedError::Panicked`] where
    /// the observer panicked.
    pub fn close(mut self) -> Result<O, QueuedError> {
        self.add_all_waiting();
        self.items = None;
        let observer = self.thread.take().and_then(|thread| self.join(thread));
        let name = self.settings.name;
        match (observer, self.take_failure()) {
            (Some(observer), None) => Ok(observer),
            (Some(_), Some(source)) => Err(QueuedError::Observer { name, source }),
            (None, _) => Err(self.panicked()),
        }
    }

    /// Adds an item as the settings say. Returns whether the queue took it.
    fn add(&mut self, item: Item) -> bool {
        let Some(items) = &self.items else { return false };
        let (taken, panicked) = match self.settings.overflow {
            Overflow::Block => {
                let handled = items.send(item).is_ok() && self.handled.recv().is_ok();
                (handled, !handled)
            }
            Overflow::Drop => match items.try_send(item) {
                Ok(()) => (true, false),
                Err(error) => (false, matches!(error, TrySendError::Disconnected(_))),
            },
        };
        if panicked {
            self.items = None;
        }
        taken
    }

    /// Adds the waiting events for which there is room.
    fn add_waiting(&mut self) {
        while let Some(event) = self.waiting.pop_front() {
            if !self.add(Item::Event(event.clone())) {
                self.waiting.push_front(event);
                break;
            }
        }
    }

    /// Waits for the end of the thread. Returns the observer; `None` if it panicked.
    fn join(&mut self, thread: JoinHandle<O>) -> Option<O> {
        match thread.join() {
            Ok(observer) => Some(observer),
            Err(payload) => {
                self.panicked = Some(panic_message(&*payload));
                None
            }
        }
    }

    fn take_failure(&self) -> Option<BoxedError> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn panicked(&self) -> QueuedError {
        let message = self.panicked.clone().unwrap_or_default();
        QueuedError::Panicked { name: self.settings.name, message }
    }
}

/// Passes the items on to the observer until the queue is closed. Sends a message to `done` after
/// each.
fn serve<O: Observer>(
    mut observer: O,
    items: &Receiver<Item>,
    failure: &Failure,
    done: Option<&Sender<()>>,
) -> O {
    for item in items {
        match item {
            Item::Frame(record) => observer.frame(&record),
            Item::Event(event) => observer.event(&event),
            Item::End(summary) => observer.end(&summary),
        }
        if let Some(error) = observer.failure() {
            failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
        if let Some(done) = done {
            // A run that has ended does not wait for it.
            let _ = done.send(());
        }
    }
    observer
}

impl<O: Observer + Send + 'static> Observer for BoundedObserver<O> {
    fn frame(&mut self, record: &FrameRecord) {
        self.add_waiting();
        let frame = record.frame.clone().filter(|_| self.settings.with_frames);
        let item = Item::Frame(Box::new(FrameRecord { frame, ..record.clone() }));
        // An event that waits comes first.
        let taken = self.waiting.is_empty() && self.add(item);
        self.dropped += u64::from(!taken);
    }

    fn event(&mut self, event: &EventRecord) {
        if self.items.is_none() {
            return;
        }
        if self.waiting.len() < MAX_WAITING {
            self.waiting.push_back(event.clone());
        } else {
            self.dropped += 1;
        }
        self.add_waiting();
    }

    /// Waits for room. The motors stand at the end of a run, so this delays no position.
    fn end(&mut self, summary: &Summary) {
        self.add_all_waiting();
        if let Some(items) = &self.items {
            let _panicked = items.send(Item::End(Box::new(summary.clone())));
        }
    }

    /// Returns a new failure of the observer, or once that it panicked.
    fn failure(&mut self) -> Option<BoxedError> {
        if let Some(error) = self.take_failure() {
            return Some(error);
        }
        // Before `close`, only a panic ends the thread.
        if self.items.is_none() || self.thread.as_ref()?.is_finished() {
            let thread = self.thread.take()?;
            self.join(thread);
            return Some(self.panicked().into());
        }
        None
    }

    fn dropped(&self) -> u64 {
        self.dropped
    }
}

impl<O> BoundedObserver<O> {
    /// Adds all waiting events. Waits for room.
    fn add_all_waiting(&mut self) {
        for event in self.waiting.drain(..) {
            let Some(items) = &self.items else { continue };
            let _panicked = items.send(Item::Event(event));
        }
    }
}

impl<O> Drop for BoundedObserver<O> {
    fn drop(&mut self) {
        self.add_all_waiting();
        self.items = None;
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

#[cfg(test)]
mod tests;
