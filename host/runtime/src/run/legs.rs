//! The drives to one target each: the one under way, those that ended, and the targets that wait.

use std::collections::VecDeque;

use nalgebra::Point3;
use plumb_protocol::units::Point;

use crate::stop_reason::StopReason;
use crate::summary::{Leg, RunStats, millimetres, round};

/// Legs of a run.
pub(super) struct Legs {
    /// Targets of the list that were not begun.
    waiting: VecDeque<Point>,
    /// Drive under way.
    current: Option<Drive>,
    /// Legs that ended, in order.
    ended: Vec<Leg>,
    /// Whether a command or a fault ended the list of targets before its end.
    is_cancelled: bool,
}

/// Drive to a target.
struct Drive {
    target: Point3<f64>,
    /// Time of its begin, seconds on the source's clock.
    begin: f64,
    /// Number of frames of the run before it.
    frames_before: u64,
}

impl Legs {
    /// Returns the legs of a run through the list `targets`.
    pub(super) fn new(targets: &[Point]) -> Self {
        let waiting = targets.iter().copied().collect();
        Self { waiting, current: None, ended: Vec::new(), is_cancelled: false }
    }

    /// Removes and returns the next target of the list.
    pub(super) fn next_target(&mut self) -> Option<Point> {
        self.waiting.pop_front()
    }

    /// Leaves out the targets of the list that were not begun.
    pub(super) fn cancel_list(&mut self) {
        self.is_cancelled |= !self.waiting.is_empty();
        self.waiting.clear();
    }

    /// Begins a leg at the time `begin`, seconds on the source's clock, after `frames` frames of
    /// the run. Returns its number, from 0.
    pub(super) fn begin(&mut self, target: Point3<f64>, begin: f64, frames: u64) -> usize {
        self.current = Some(Drive { target, begin, frames_before: frames });
        self.ended.len()
    }

    /// Returns whether a leg is under way.
    pub(super) fn is_driving(&self) -> bool {
        self.current.is_some()
    }

    /// Returns the time since the begin of the leg under way; 0 where there is none. `now` is the
    /// time on the source's clock, seconds.
    pub(super) fn elapsed(&self, now: f64) -> f64 {
        self.current.as_ref().map_or(0.0, |drive| now - drive.begin)
    }

    /// Ends the leg under way. Returns its number; `None` where there is none.
    pub(super) fn end(&mut self, ending: StopReason, stats: &RunStats) -> Option<usize> {
        let drive = self.current.take()?;
        let target: [f64; 3] = drive.target.into();
        self.ended.push(Leg {
            target: target.map(|metres| round(metres, 1e6)),
            frames: stats.frames - drive.frames_before,
            reached: ending == StopReason::Reached,
            ending,
            error_mm: stats.error.map(millimetres),
        });
        Some(self.ended.len() - 1)
    }

    /// Returns whether every target of the list and of the operator was reached.
    pub(super) fn all_reached(&self) -> bool {
        let is_complete = self.waiting.is_empty() && !self.is_cancelled && !self.is_driving();
        is_complete && self.ended.iter().all(|leg| leg.reached)
    }

    /// Returns the legs that ended.
    pub(super) fn into_ended(self) -> Vec<Leg> {
        self.ended
    }
}
