//! A bounded queue and a thread between a run and an observer that writes.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use plumb_cameras::record::Overflow;
use plumb_cameras::source::BoxedError;

use crate::observer::{FrameRecord, Observer, RunEvent};
use crate::run::Summary;

/// Settings of the queue before an observer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueSettings {
    /// Name of the thread.
    pub name: &'static str,
    /// Number of records that may wait.
    pub capacity: usize,
    /// What to do with a record when the queue is full.
    pub overflow: Overflow,
    /// Whether the records keep their frames: 1.5 MB each at 640x480.
    pub with_frames: bool,
}

/// Item of the queue.
enum Item {
    Frame(Box<FrameRecord>),
    Event(RunEvent),
    End(Box<Summary>),
}

/// Failure of the observer, from its thread to the run.
type Failure = Arc<Mutex<Option<BoxedError>>>;

/// Observer that runs in a thread of its own, behind a bounded queue. A slow observer never delays
/// the run: with [`Overflow::Drop`] a record for which there is no room is dropped and counted.
pub struct Queued<O> {
    items: SyncSender<Item>,
    thread: JoinHandle<O>,
    failure: Failure,
    settings: QueueSettings,
    dropped: u64,
}

impl<O: Observer + Send + 'static> Queued<O> {
    /// Starts the thread of `observer`.
    ///
    /// # Errors
    /// Where the operating system starts no thread.
    pub fn new(observer: O, settings: QueueSettings) -> std::io::Result<Self> {
        let (items, incoming) = sync_channel(settings.capacity);
        let failure = Failure::default();
        let shared = Arc::clone(&failure);
        let thread = thread::Builder::new()
            .name(settings.name.to_owned())
            .spawn(move || serve(observer, &incoming, &shared))?;
        Ok(Self { items, thread, failure, settings, dropped: 0 })
    }

    /// Waits until the observer has received everything. Returns it; `None` if it panicked.
    pub fn close(self) -> Option<O> {
        drop(self.items);
        self.thread.join().ok()
    }

    /// Adds an item as the settings say.
    fn add(&mut self, item: Item) {
        // A thread that ended by a panic takes nothing; `close` reports it.
        let lost = match self.settings.overflow {
            Overflow::Block => self.items.send(item).is_err(),
            Overflow::Drop => matches!(
                self.items.try_send(item),
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_))
            ),
        };
        self.dropped += u64::from(lost);
    }
}

/// Passes the items on to the observer until the queue is closed.
fn serve<O: Observer>(mut observer: O, items: &Receiver<Item>, failure: &Failure) -> O {
    for item in items {
        match item {
            Item::Frame(record) => observer.frame(&record),
            Item::Event(event) => observer.event(&event),
            Item::End(summary) => observer.end(&summary),
        }
        if let Some(error) = observer.failure() {
            failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }
    observer
}

impl<O: Observer + Send + 'static> Observer for Queued<O> {
    fn frame(&mut self, record: &FrameRecord) {
        let frame = record.frame.clone().filter(|_| self.settings.with_frames);
        self.add(Item::Frame(Box::new(FrameRecord { frame, ..record.clone() })));
    }

    fn event(&mut self, event: &RunEvent) {
        self.add(Item::Event(event.clone()));
    }

    /// Waits for room. The motors stand at the end of a run, so this delays no position.
    fn end(&mut self, summary: &Summary) {
        let _panicked = self.items.send(Item::End(Box::new(summary.clone())));
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Sender, channel};

    use nalgebra::Point3;

    use super::*;

    /// Waits for permission before each record, and counts the records.
    struct Slow {
        permission: Receiver<()>,
        numbers: Vec<u64>,
    }

    impl Observer for Slow {
        fn frame(&mut self, record: &FrameRecord) {
            let _ = self.permission.recv();
            self.numbers.push(record.number);
        }

        fn failure(&mut self) -> Option<BoxedError> {
            self.numbers.contains(&1).then(|| "a full disk".into())
        }
    }

    fn record(number: u64) -> FrameRecord {
        let target = Point3::origin();
        let (frame, observation, telemetry, state) = (None, None, None, None);
        FrameRecord { number, time: 0.0, frame, observation, target, telemetry, state }
    }

    fn slow(overflow: Overflow) -> (Queued<Slow>, Sender<()>) {
        let (allow, permission) = channel();
        let observer = Slow { permission, numbers: Vec::new() };
        let settings = QueueSettings { name: "slow", capacity: 2, overflow, with_frames: false };
        (Queued::new(observer, settings).unwrap(), allow)
    }

    #[test]
    fn a_slow_observer_delays_nothing_and_drops_are_counted() {
        let (mut queued, allow) = slow(Overflow::Drop);
        (0..100).for_each(|number| queued.frame(&record(number)));
        drop(allow);
        let dropped = queued.dropped();
        let numbers = queued.close().unwrap().numbers;
        // One record with the observer, two in the queue.
        assert!((2..=3).contains(&numbers.len()), "{numbers:?}");
        assert_eq!(numbers.len() as u64 + dropped, 100);
    }

    #[test]
    fn a_queue_that_blocks_drops_nothing_and_failures_reach_the_run() {
        let (mut queued, allow) = slow(Overflow::Block);
        drop(allow);
        (0..100).for_each(|number| queued.frame(&record(number)));
        while queued.failure().is_none() {
            thread::yield_now();
        }
        assert_eq!(queued.dropped(), 0);
        assert_eq!(queued.close().unwrap().numbers, Vec::from_iter(0..100));
    }
}
