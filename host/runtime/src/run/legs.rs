//! The drives to one target each: the one under way, those that ended, and the waypoints that wait.

use std::collections::VecDeque;

use super::waypoint::{CheckedWaypoint, Route, Waypoint};
use crate::stop_reason::StopReason;
use crate::summary::{Leg, RunStats, millimetres, round};

/// Legs of a run.
pub(super) struct Legs {
    /// Waypoints of the list that were not begun.
    waiting: VecDeque<CheckedWaypoint>,
    /// Whether a waypoint waits again once it was begun.
    is_repeated: bool,
    /// Drive under way.
    current: Option<Drive>,
    /// Legs that ended, in order.
    ended: Vec<Leg>,
    /// Whether a command or a fault ended the list of targets before its end.
    is_cancelled: bool,
}

/// Drive to a target.
struct Drive {
    waypoint: Waypoint,
    /// Time of its begin, seconds on the source's clock.
    begin: f64,
    /// Time at which the target was reached, seconds on the source's clock.
    reached: Option<f64>,
    /// Number of frames of the run before it.
    frames_before: u64,
}

impl Legs {
    /// Returns the legs of a run along `route`.
    pub(super) fn new(route: &Route) -> Self {
        let waiting = route.waypoints.iter().copied().collect();
        let is_repeated = route.is_repeated;
        Self { waiting, is_repeated, current: None, ended: Vec::new(), is_cancelled: false }
    }

    /// Removes and returns the next waypoint of the list. In a repeated list it waits again.
    pub(super) fn next_waypoint(&mut self) -> Option<CheckedWaypoint> {
        let next = self.waiting.pop_front()?;
        if self.is_repeated {
            self.waiting.push_back(next);
        }
        Some(next)
    }

    /// Leaves out the targets of the list that were not begun.
    pub(super) fn cancel_list(&mut self) {
        self.is_cancelled |= !self.waiting.is_empty();
        self.waiting.clear();
    }

    /// Begins a leg at the time `begin`, seconds on the source's clock, after `frames` frames of
    /// the run. Returns its number, from 0.
    pub(super) fn begin(&mut self, waypoint: Waypoint, begin: f64, frames: u64) -> usize {
        self.current = Some(Drive { waypoint, begin, reached: None, frames_before: frames });
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

    /// Returns the tolerance of the waypoint under way, metres; `None` for the rig file's.
    pub(super) fn tolerance(&self) -> Option<f64> {
        self.current.as_ref()?.waypoint.tolerance_m
    }

    /// Notes that the target was reached at the time `now`, seconds on the source's clock.
    pub(super) fn note_reached(&mut self, now: f64) {
        if let Some(drive) = &mut self.current {
            drive.reached.get_or_insert(now);
        }
    }

    /// Returns whether the target was reached.
    pub(super) fn is_reached(&self) -> bool {
        self.current.as_ref().is_some_and(|drive| drive.reached.is_some())
    }

    /// Returns whether the ball has been at the target for the waypoint's dwell time.
    pub(super) fn has_dwelt(&self, now: f64) -> bool {
        self.current.as_ref().is_some_and(|drive| {
            drive.reached.is_some_and(|reached| now - reached >= drive.waypoint.dwell_s)
        })
    }

    /// Ends the leg under way. Returns its number; `None` where there is none.
    pub(super) fn end(&mut self, ending: StopReason, stats: &RunStats) -> Option<usize> {
        let drive = self.current.take()?;
        // An interrupt during the dwell time does not undo the arrival.
        let was_reached = drive.reached.is_some() && ending == StopReason::Interrupted;
        self.ended.push(Leg {
            target: drive.waypoint.target.map(|metres| round(metres, 1e6)),
            frames: stats.frames - drive.frames_before,
            reached: was_reached || ending == StopReason::Reached,
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
