use std::error::Error;
use std::time::Duration;

use super::*;
use crate::observer::{self, RunEvent};

/// Waits for permission before each record, and lists the records.
struct Slow {
    permission: Receiver<()>,
    numbers: Vec<u64>,
    /// Number of the record that fails.
    fails_at: u64,
}

impl Observer for Slow {
    fn frame(&mut self, record: &FrameRecord) {
        let _ = self.permission.recv();
        self.numbers.push(record.number);
    }

    fn failure(&mut self) -> Option<BoxedError> {
        self.numbers.ends_with(&[self.fails_at]).then(|| "a full disk".into())
    }
}

fn record(number: u64) -> FrameRecord {
    FrameRecord { number, frame: None, ..observer::tests::record() }
}

fn slow(overflow: Overflow, fails_at: u64) -> (BoundedObserver<Slow>, Sender<()>) {
    let (allow, permission) = channel();
    let observer = Slow { permission, numbers: Vec::new(), fails_at };
    let settings =
        QueueSettings { name: "slow observer", capacity: 2, overflow, with_frames: false };
    (BoundedObserver::new(observer, settings).unwrap(), allow)
}

#[test]
fn a_slow_observer_delays_nothing_and_drops_are_counted() {
    let (mut queued, allow) = slow(Overflow::Drop, u64::MAX);
    (0..100).for_each(|number| queued.frame(&record(number)));
    drop(allow);
    let dropped = queued.dropped();
    let numbers = queued.close().unwrap().numbers;
    // One record with the observer, two in the queue.
    assert!((2..=3).contains(&numbers.len()), "{numbers:?}");
    assert_eq!(numbers.len() as u64 + dropped, 100);
}

/// Waits for permission before each record, and lists what it receives.
struct Words {
    permission: Receiver<()>,
    received: Vec<String>,
}

impl Observer for Words {
    fn frame(&mut self, record: &FrameRecord) {
        let _closed = self.permission.recv();
        self.received.push(record.number.to_string());
    }

    fn event(&mut self, event: &EventRecord) {
        self.received.push(event.event.to_string());
    }
}

fn lost(message: &str) -> EventRecord {
    EventRecord { time: 0.0, event: RunEvent::FrameLost { message: message.to_owned() } }
}

#[test]
fn an_event_waits_for_room_and_comes_before_the_next_record() {
    let (allow, permission) = channel();
    let words = Words { permission, received: Vec::new() };
    let settings = QueueSettings {
        name: "slow observer",
        capacity: 2,
        overflow: Overflow::Drop,
        with_frames: false,
    };
    let mut queued = BoundedObserver::new(words, settings).unwrap();
    (0..10).for_each(|number| queued.frame(&record(number)));
    let events: Vec<EventRecord> = (0..50).map(|number| lost(&format!("event {number}"))).collect();
    events.iter().for_each(|event| queued.event(event));
    queued.frame(&record(10));
    let dropped = queued.dropped();
    drop(allow);
    let received = queued.close().unwrap().received;
    let words: Vec<String> = events.iter().map(|event| event.event.to_string()).collect();
    // The records that found room came before the events; the last found none.
    assert_eq!(received.len() as u64, 11 - dropped + 50);
    assert_eq!(received[received.len() - 50..], words);
}

#[test]
fn a_queue_that_blocks_drops_nothing_and_fails_at_the_record() {
    let (mut queued, allow) = slow(Overflow::Block, 50);
    drop(allow);
    for number in 0..100 {
        queued.frame(&record(number));
        assert_eq!(queued.failure().is_some(), number == 50);
    }
    assert_eq!(queued.dropped(), 0);
    assert_eq!(queued.close().unwrap().numbers, Vec::from_iter(0..100));
}

#[test]
fn a_failure_after_the_last_question_is_an_error_of_close() {
    let (mut queued, allow) = slow(Overflow::Drop, 1);
    (0..2).for_each(|number| queued.frame(&record(number)));
    drop(allow);
    let error = queued.close().err().unwrap();
    assert_eq!(error.to_string(), "the slow observer has failed");
    assert_eq!(error.source().unwrap().to_string(), "a full disk");
}

/// Panics on record 3.
#[derive(Debug)]
struct Panics;

impl Observer for Panics {
    fn frame(&mut self, record: &FrameRecord) {
        assert_ne!(record.number, 3, "an unexpected record");
    }
}

#[test]
fn a_panic_of_the_observer_is_one_failure_and_an_error_of_close() {
    for overflow in [Overflow::Drop, Overflow::Block] {
        let settings =
            QueueSettings { name: "observer", capacity: 9, overflow, with_frames: false };
        let mut queued = BoundedObserver::new(Panics, settings).unwrap();
        (0..=3).for_each(|number| queued.frame(&record(number)));
        let failure = loop {
            match queued.failure() {
                Some(failure) => break failure.to_string(),
                // A queue that blocks reports it at once.
                None => assert_eq!(overflow, Overflow::Drop),
            }
            thread::yield_now();
        };
        assert!(failure.contains("observer has panicked"), "{failure}");
        assert!(failure.contains("an unexpected record"), "{failure}");
        let dropped = queued.dropped();
        queued.frame(&record(4));
        let event = RunEvent::FrameLost { message: String::new() };
        queued.event(&EventRecord { time: 0.0, event });
        assert!(queued.failure().is_none());
        assert_eq!(queued.dropped(), dropped + 1);
        assert_eq!(queued.close().unwrap_err().to_string(), failure);
    }
}

/// Adds the numbers of the records to a list that the test has too.
struct Listed(Arc<Mutex<Vec<u64>>>);

impl Observer for Listed {
    fn frame(&mut self, record: &FrameRecord) {
        thread::sleep(Duration::from_millis(2));
        self.0.lock().unwrap().push(record.number);
    }
}

#[test]
fn a_run_that_panics_loses_no_record() {
    let list = Arc::default();
    let settings = QueueSettings {
        name: "observer",
        capacity: 50,
        overflow: Overflow::Drop,
        with_frames: false,
    };
    let mut queued = BoundedObserver::new(Listed(Arc::clone(&list)), settings).unwrap();
    let run = thread::spawn(move || {
        (0..40).for_each(|number| queued.frame(&record(number)));
        panic!("a defect");
    });
    assert!(run.join().is_err());
    assert_eq!(*list.lock().unwrap(), Vec::from_iter(0..40));
}
