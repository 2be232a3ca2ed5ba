//! Memory between a run and the thread of its node.

use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use plumb_frame::clock::LiveClock;
use plumb_frame::observation::Gaussian3;
use plumb_runtime::observer::{FrameRecord, RunEvent, TargetsEvent};
use plumb_runtime::operator::OperatorSender;
use plumb_runtime::run::Summary;
use plumb_runtime::wall_clock::{FrameTime, RunClock};
use rustdds::mio1::Waker;

use crate::ledger::Ledger;
use crate::message::Time;
use crate::moving_status::MovingStatus;
use crate::status::RunStatus;

/// The ball in a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// Stamp of the colour picture as its node has sent it; for another camera the wall clock at
    /// the exposure of the frame.
    pub(crate) stamp: Time,
    /// Position of the ball; `None` if it is unknown.
    pub(crate) position: Option<Gaussian3>,
}

/// State of a run that its node publishes.
#[derive(Debug)]
pub(crate) struct FeedState {
    /// The newest sample that is not published yet.
    pub(crate) sample: Option<Sample>,
    /// Clock of the samples.
    clock: RunClock,
    /// Status for the diagnostics.
    pub(crate) status: RunStatus,
    /// Status of targets that move.
    pub(crate) moving: MovingStatus,
    /// Whether an event has come since the last diagnostics.
    pub(crate) has_news: bool,
    /// Commands of the node.
    pub(crate) ledger: Ledger,
    /// Whether the thread must end.
    pub(crate) is_closing: bool,
}

/// Memory between a run and the thread of its node: the run writes, and wakes the thread.
#[derive(Debug)]
pub(crate) struct Feed {
    state: Mutex<FeedState>,
    waker: Waker,
}

impl Feed {
    /// Returns the feed of a run that takes commands from `operator`.
    pub(crate) fn new(operator: OperatorSender, waker: Waker) -> Self {
        let state = FeedState {
            sample: None,
            clock: RunClock::default(),
            status: RunStatus::new(Instant::now()),
            moving: MovingStatus::default(),
            has_news: true,
            ledger: Ledger::new(operator),
            is_closing: false,
        };
        Self { state: Mutex::new(state), waker }
    }

    /// Locks the state.
    pub(crate) fn state(&self) -> MutexGuard<'_, FeedState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the thread.
    fn wake(&self) {
        // A thread that is awake already does not read its wake-up in time.
        let _full: io::Result<()> = self.waker.wake();
    }

    /// Sets the clock that stamps the frames.
    pub(crate) fn set_clock(&self, clock: LiveClock) {
        self.state().clock.set_frames_clock(clock);
    }

    /// Writes the record of a frame.
    pub(crate) fn frame(&self, record: &FrameRecord) {
        let position = record.observation.and_then(|ball| ball.position);
        let (frame, mut state) = (record.frame.as_ref(), self.state());
        let clock = frame.map(|frame| frame.time());
        let exposed = state.clock.stamp_frame(FrameTime { run: record.time, clock });
        let sent = frame.and_then(|frame| frame.sender_stamp());
        let stamp = sent.map_or(Time::from_nanoseconds(exposed), Time::from);
        state.sample = Some(Sample { stamp, position });
        state.status.note_frame(record, Instant::now());
        drop(state);
        self.wake();
    }

    /// Writes an event.
    pub(crate) fn event(&self, event: &RunEvent) {
        let mut state = self.state();
        state.status.note_event(event);
        state.has_news = true;
        if let RunEvent::Command { number, command, outcome } = event {
            state.ledger.settle(*number, *command, *outcome);
        }
        if let RunEvent::Targets(event @ TargetsEvent::Refused { .. }) = event {
            state.moving.show(event.to_string(), Instant::now());
        }
        drop(state);
        self.wake();
    }

    /// Writes the end of the run.
    pub(crate) fn end(&self, summary: &Summary) {
        let mut state = self.state();
        state.status.record_end(summary);
        state.has_news = true;
        drop(state);
        self.wake();
    }

    /// Ends the thread.
    pub(crate) fn close(&self) {
        self.state().is_closing = true;
        self.wake();
    }
}
