//! The drives to one target each: the one under way, those that ended, and the waypoints that wait.

mod ended;

use std::collections::VecDeque;

pub(super) use ended::EndedLegs;

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
    /// Legs that ended.
    ended: EndedLegs,
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
        let ended = EndedLegs::default();
        Self { waiting, is_repeated, current: None, ended, is_cancelled: false }
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
        self.ended.count()
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

    /// Moves the target of the leg under way, metres.
    pub(super) fn move_target(&mut self, target: [f64; 3]) {
        if let Some(drive) = &mut self.current {
            drive.waypoint.target = target;
        }
    }

    /// Has the leg under way end once its target is reached: a target that moved stays there.
    pub(super) fn come_to_an_end(&mut self) {
        if let Some(drive) = &mut self.current {
            (drive.waypoint.dwell_s, drive.reached) = (0.0, None);
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
        // A person who ends the leg during the dwell time does not undo the arrival.
        let was_reached = drive.reached.is_some() && ending.is_chosen();
        self.ended.push(Leg {
            target: drive.waypoint.target.map(|metres| round(metres, 1e6)),
            frames: stats.frames - drive.frames_before,
            reached: was_reached || ending == StopReason::Reached,
            ending,
            error_mm: stats.error.map(millimetres),
        });
        Some(self.ended.count() - 1)
    }

    /// Returns whether every target of the list and of the operator was reached.
    pub(super) fn all_reached(&self) -> bool {
        let is_complete = self.waiting.is_empty() && !self.is_cancelled && !self.is_driving();
        is_complete && self.ended.count() > 0 && self.ended.reached() == self.ended.count()
    }

    /// Returns the legs that ended.
    pub(super) fn into_ended(self) -> EndedLegs {
        self.ended
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::message::Fault;

    use super::*;

    /// Returns whether a leg counts as reached that ended for `ending` during its dwell time.
    fn is_reached_after(ending: StopReason) -> bool {
        let route = Route { waypoints: Vec::new(), is_repeated: false };
        let mut legs = Legs::new(&route);
        let waypoint = Waypoint { dwell_s: 2.0, ..Waypoint::new([0.4, 0.3, 0.2]) };
        legs.begin(waypoint, 0.0, 0);
        legs.note_reached(1.0);
        legs.end(ending, &RunStats::default());
        legs.all_reached()
    }

    /// The leg number `number` takes as many frames and is reached, but for one of ten.
    #[test]
    fn of_many_legs_the_first_and_the_last_are_kept_and_all_are_counted() {
        const ALL: usize = 25_000;
        let mut legs = Legs::new(&Route { waypoints: Vec::new(), is_repeated: false });
        let mut stats = RunStats::default();
        for number in 0..ALL {
            let begun = legs.begin(Waypoint::new([0.4, 0.3, 0.2]), 0.0, stats.frames);
            stats.frames += number as u64;
            let ending = if number % 10 == 0 { StopReason::Stopped } else { StopReason::Reached };
            assert_eq!((Some(begun), begun), (legs.end(ending, &stats), number));
        }
        assert!(!legs.all_reached());
        let ended = legs.into_ended();
        assert_eq!((ended.count(), ended.reached()), (ALL, ALL - ALL / 10));
        let kept: Vec<u64> = ended.into_kept().iter().map(|leg| leg.frames).collect();
        let expected = (0..100).chain(ALL as u64 - 900..ALL as u64);
        assert!(kept.iter().copied().eq(expected), "{kept:?}");
    }

    #[test]
    fn a_leg_that_is_left_out_and_was_not_reached_counts() {
        let mut legs = Legs::new(&Route { waypoints: Vec::new(), is_repeated: false });
        for number in 0..3000 {
            legs.begin(Waypoint::new([0.4, 0.3, 0.2]), 0.0, 0);
            let missed = number == 1000;
            let ending = if missed { StopReason::Timeout } else { StopReason::Reached };
            legs.end(ending, &RunStats::default());
        }
        assert!(!legs.all_reached());
        assert!(legs.into_ended().into_kept().iter().all(|leg| leg.reached));
    }

    #[test]
    fn a_command_during_the_dwell_time_does_not_undo_the_arrival() {
        for ending in [StopReason::Stopped, StopReason::Held, StopReason::Replaced] {
            assert!(is_reached_after(ending.clone()), "{ending}");
        }
        assert!(is_reached_after(StopReason::Ended));
        assert!(is_reached_after(StopReason::Interrupted));
    }

    #[test]
    fn a_fault_or_a_lost_source_during_the_dwell_time_is_no_success() {
        assert!(!is_reached_after(StopReason::Fault(Fault::BallOutside.into())));
        assert!(!is_reached_after(StopReason::EndOfFrames));
        assert!(!is_reached_after(StopReason::Failed("the camera is gone".to_owned())));
    }
}
