//! Memory between a run and its page. It is bounded: the newest replaces the oldest.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use mio::Waker;
use plumb_frame::frame::RgbdFrame;
use plumb_protocol::message::{State, Telemetry};
use plumb_protocol::units::{Rate, Steps16};
use plumb_runtime::advice::after_fault;
use plumb_runtime::observer::{FrameRecord, RunEvent};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand};
use plumb_runtime::run::{StopReason, Summary};

use crate::message::{
    BoardView, Ended, Event, EventKind, FaultView, FrameView, Goal, Sample, Update,
};

/// Number of samples in memory: 2 minutes at 30 frames/s.
pub(crate) const SAMPLES: usize = 3600;

/// Number of events in memory.
pub(crate) const EVENTS: usize = 100;

/// What the run hands to the page's thread.
pub(crate) struct Feed {
    news: Mutex<News>,
    waker: Waker,
    /// Number of open pages. Without one no frame is kept.
    watchers: AtomicUsize,
    closing: AtomicBool,
}

/// What the page knows of the run.
#[derive(Default)]
struct News {
    /// Counts every change.
    version: u64,
    samples: Numbered<Sample>,
    events: Numbered<Event>,
    frame: Option<FrameView>,
    image: Option<Arc<RgbdFrame>>,
    board: Option<BoardView>,
    goal: Option<Goal>,
    ended: Option<Ended>,
}

/// Ring of the newest items, numbered from 0 since the start.
struct Numbered<T> {
    items: VecDeque<T>,
    /// Number of the item that comes next.
    next: u64,
}

impl<T> Default for Numbered<T> {
    fn default() -> Self {
        Self { items: VecDeque::new(), next: 0 }
    }
}

impl<T: Clone> Numbered<T> {
    fn push(&mut self, item: T, capacity: usize) {
        if self.items.len() == capacity {
            self.items.pop_front();
        }
        self.items.push_back(item);
        self.next += 1;
    }

    /// Returns the items from number `from` on, and how many of those are gone.
    fn since(&self, from: u64) -> (Vec<T>, u64) {
        let first = self.next - self.items.len() as u64;
        let skipped = from.saturating_sub(first) as usize;
        (self.items.iter().skip(skipped).cloned().collect(), first.saturating_sub(from))
    }
}

/// What a client has been sent so far: the number of the next sample and the next event; `None` at
/// its beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Cursor {
    next: Option<(u64, u64)>,
}

impl Feed {
    pub(crate) fn new(waker: Waker) -> Self {
        let (watchers, closing) = (AtomicUsize::new(0), AtomicBool::new(false));
        Self { news: Mutex::default(), waker, watchers, closing }
    }

    /// Takes a frame of the run.
    pub(crate) fn frame(&self, record: &FrameRecord) {
        let image = record.frame.clone().filter(|_| self.watchers.load(Ordering::Relaxed) > 0);
        let mut news = self.lock();
        news.samples.push(sample(record), SAMPLES);
        news.frame = Some(frame_view(record));
        news.board = record.telemetry.as_ref().map(board_view);
        // The old frame is freed after the lock.
        let old = std::mem::replace(&mut news.image, image);
        self.publish(news);
        drop(old);
    }

    /// Takes an event of the run.
    pub(crate) fn event(&self, event: &RunEvent) {
        let mut news = self.lock();
        match event {
            RunEvent::TargetSet { target, .. } => {
                let target: [f64; 3] = (*target).into();
                let [x, y, z] = target;
                news.goal = Some(Goal { target, reached: false, ending: None });
                let text = format!("target set: ({x:.3}, {y:.3}, {z:.3}) m");
                news.add_event(EventKind::Note, text);
            }
            RunEvent::TargetEnded { reason, .. } => {
                let reached = *reason == StopReason::Reached;
                if let Some(goal) = &mut news.goal {
                    goal.reached = reached;
                    goal.ending = Some(reason.to_string());
                }
                let kind = if reached { EventKind::Good } else { EventKind::Bad };
                news.add_event(kind, format!("target: {reason}"));
            }
            RunEvent::FrameLost { message } => {
                news.add_event(EventKind::Bad, format!("a picture was lost: {message}"));
            }
            RunEvent::Command { command, outcome, .. } => news.add_outcome(command, outcome),
            RunEvent::BoardStopped { fault } => {
                news.add_event(EventKind::Bad, format!("the board has stopped by itself: {fault}"));
            }
            // A kind of event that has no text here.
            _ => return,
        }
        self.publish(news);
    }

    /// Takes the end of the run.
    pub(crate) fn end(&self, summary: &Summary) {
        let ending = summary.ending.to_string();
        let mut news = self.lock();
        news.add_event(EventKind::Note, format!("the run has ended: {ending}"));
        news.ended = Some(Ended { ending, at_rest: summary.at_rest });
        self.publish(news);
    }

    /// Returns the number of changes so far.
    pub(crate) fn version(&self) -> u64 {
        self.lock().version
    }

    /// Returns the update number `number` for a client, and advances its cursor.
    pub(crate) fn update(&self, number: u64, cursor: &mut Cursor) -> Update {
        let news = self.lock();
        let (next_sample, next_event) = cursor.next.unwrap_or_default();
        let (samples, missed) = news.samples.since(next_sample);
        let (events, _) = news.events.since(next_event);
        // What happened before a client came is not missed by it.
        let missed = cursor.next.map_or(0, |_| missed);
        *cursor = Cursor { next: Some((news.samples.next, news.events.next)) };
        Update {
            number,
            picture: None,
            samples,
            frame: news.frame,
            board: news.board.clone(),
            goal: news.goal.clone(),
            events,
            missed,
            ended: news.ended.clone(),
        }
    }

    /// Returns the newest frame with the ball in it, if there is one.
    pub(crate) fn image(&self) -> Option<(FrameView, Arc<RgbdFrame>)> {
        let news = self.lock();
        Some((news.frame?, Arc::clone(news.image.as_ref()?)))
    }

    /// Sets the number of open pages.
    pub(crate) fn set_watchers(&self, count: usize) {
        self.watchers.store(count, Ordering::Relaxed);
    }

    /// Asks the page's thread to end.
    pub(crate) fn close(&self) {
        self.closing.store(true, Ordering::Relaxed);
        let _ = self.waker.wake();
    }

    pub(crate) fn is_closing(&self) -> bool {
        self.closing.load(Ordering::Relaxed)
    }

    /// Counts the change, releases the memory and wakes the page's thread.
    fn publish(&self, mut news: MutexGuard<'_, News>) {
        news.version += 1;
        drop(news);
        // A page that cannot be woken looks once a second.
        let _ = self.waker.wake();
    }

    fn lock(&self) -> MutexGuard<'_, News> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl News {
    fn add_outcome(&mut self, command: &OperatorCommand, outcome: &CommandOutcome) {
        match outcome {
            CommandOutcome::Accepted => {
                if *command == OperatorCommand::Hold {
                    // The board holds the ball where it is, and no target of a person.
                    self.goal = None;
                }
                self.add_event(EventKind::Good, format!("{command}: accepted"));
            }
            CommandOutcome::Refused(refusal) => {
                self.add_event(EventKind::Bad, format!("{command}: {refusal}"));
            }
        }
    }

    fn add_event(&mut self, kind: EventKind, text: String) {
        let number = self.events.next;
        self.events.push(Event { number, kind, text }, EVENTS);
    }
}

/// Rounds to the micrometre, or the microsecond.
fn round(value: f64) -> f64 {
    // Zero is added to write -0 as 0.
    (value * 1e6).round() / 1e6 + 0.0
}

fn sample(record: &FrameRecord) -> Sample {
    let position = record.position().map(|p| <[f64; 3]>::from(p).map(round));
    let position = position.map_or([None; 3], |p| p.map(Some));
    let target = <[f64; 3]>::from(record.target).map(round);
    Sample(record.number, round(record.time), position, record.error().map(round), target)
}

fn frame_view(record: &FrameRecord) -> FrameView {
    FrameView {
        number: record.number,
        time: round(record.time),
        circle: record.observation.map(|ball| {
            let circle = ball.circle;
            [circle.u, circle.v, circle.radius].map(|pixels| (pixels * 100.0).round() / 100.0)
        }),
        position: record.position().map(|p| <[f64; 3]>::from(p).map(round)),
    }
}

fn board_view(telemetry: &Telemetry) -> BoardView {
    let fault = match telemetry.state {
        State::Fault(fault) => {
            Some(FaultView { text: fault.to_string(), next: after_fault(fault) })
        }
        _ => None,
    };
    BoardView {
        state: state_name(telemetry.state),
        fault,
        rates: telemetry.rates.map(Rate::to_si).map(|rate| (rate * 10.0).round() / 10.0 + 0.0),
        motors: telemetry.motors.map(Steps16::to_si),
        filtered_error: telemetry.target.map(|_| telemetry.filtered_error.to_si()),
        bad_frames: telemetry.bad_frames,
    }
}

/// Returns the name of a state, without its details.
fn state_name(state: State) -> &'static str {
    match state {
        State::Unconfigured => "unconfigured",
        State::Ready => "ready",
        State::Seeking => "seeking",
        State::Holding => "holding",
        State::Fault(_) => "fault",
        State::Jogging => "jogging",
        State::Stopping => "stopping",
        State::Storing => "storing",
    }
}

#[cfg(test)]
mod tests;
