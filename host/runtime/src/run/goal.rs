//! The state of a run: what the ball is to do, as far as the host knows, and the legs that wait or
//! have ended.
//!
//! ```text
//!             a target of the list, or of the operator
//!   Idle ---------------------------------------------> Waypoint
//!   Idle ------- a target that moves ------------------> Moving
//!   Waypoint --- the list is done, a path follows -----> Path
//!   Path, Moving -- a command that ends it is sent ----> Waypoint (its answer is due)
//!   Waypoint, Path, Moving -- reached, stopped, timeout -> Idle, or the next target
//!   any -------- the board accepts a Hold -------------> Settling -- it holds the ball --> Held
//!   Idle ------- the board accepts a jog --------------> Jogging -- the motor stands ----> Idle
//!   any -------- the board stops by itself ------------> Faulted -- the fault is cleared -> Idle
//! ```
//!
//! The Stop in force the rig is apart from the goal
//! ([`StopEvent`](crate::operator::StopEvent)): a fault and its clearing leave it.

use std::collections::VecDeque;

use plumb_protocol::message::Fault;

use super::first_and_last::FirstAndLast;
use super::path::PathDrive;
use super::waypoint::{CheckedWaypoint, Route, Waypoint};
use crate::rounding::{millimetres, round};
use crate::stop_reason::StopReason;
use crate::summary::{Leg, RunStats};

/// Goal of a run at one time.
pub(super) enum Goal {
    /// None: the run waits for its operator, or for a target that moves.
    Idle,
    /// The ball drives to a target.
    Waypoint(Drive),
    /// The ball follows a path to its end.
    Path(Drive, Box<PathDrive>),
    /// The ball follows a target that moves.
    Moving(Drive),
    /// The ball comes to rest after a Hold.
    Settling,
    /// The board holds the ball after a Hold.
    Held,
    /// A motor turns by a command.
    Jogging,
    /// The board has stopped by itself, and no drive is under way.
    Faulted(Fault),
}

impl Goal {
    /// Returns the drive under way.
    pub(super) fn drive(&self) -> Option<&Drive> {
        match self {
            Self::Waypoint(drive) | Self::Path(drive, _) | Self::Moving(drive) => Some(drive),
            Self::Idle | Self::Settling | Self::Held | Self::Jogging | Self::Faulted(_) => None,
        }
    }

    /// Returns the drive under way.
    pub(super) fn drive_mut(&mut self) -> Option<&mut Drive> {
        match self {
            Self::Waypoint(drive) | Self::Path(drive, _) | Self::Moving(drive) => Some(drive),
            Self::Idle | Self::Settling | Self::Held | Self::Jogging | Self::Faulted(_) => None,
        }
    }

    /// Returns the path under way.
    pub(super) fn path(&self) -> Option<&PathDrive> {
        if let Self::Path(_, path) = self { Some(path) } else { None }
    }

    /// Returns whether the ball follows a target that moves.
    pub(super) fn is_moving(&self) -> bool {
        matches!(self, Self::Moving(_))
    }

    /// Returns the name of the goal, for messages of the log.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Waypoint(_) => "waypoint",
            Self::Path(..) => "path",
            Self::Moving(_) => "moving",
            Self::Settling => "settling",
            Self::Held => "held",
            Self::Jogging => "jogging",
            Self::Faulted(_) => "faulted",
        }
    }
}

/// Drive to a target. Times are in seconds on the source's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drive {
    /// The target, its dwell time and its tolerance.
    pub(super) waypoint: Waypoint,
    /// Time of its start.
    begin: f64,
    /// Time at which the target was reached.
    reached: Option<f64>,
    /// Number of frames of the run before it.
    pub(super) frames_before: u64,
}

impl Drive {
    /// Returns a drive that begins at `now`, after `frames` frames of the run.
    pub(super) fn new(waypoint: Waypoint, now: f64, frames: u64) -> Self {
        Self { waypoint, begin: now, reached: None, frames_before: frames }
    }

    /// Returns the time since its start.
    pub(super) fn elapsed(&self, now: f64) -> f64 {
        now - self.begin
    }

    /// Notes that the target is reached at `now`.
    pub(super) fn note_reached(&mut self, now: f64) {
        self.reached.get_or_insert(now);
    }

    /// Returns whether the target was reached.
    pub(super) fn is_reached(&self) -> bool {
        self.reached.is_some()
    }

    /// Returns whether the ball has been at the target for the waypoint's dwell time.
    pub(super) fn has_dwelt(&self, now: f64) -> bool {
        self.reached.is_some_and(|reached| now - reached >= self.waypoint.dwell_s)
    }

    /// Has the drive end once its target is reached: a target that moved stays there.
    pub(super) fn finish(&mut self) {
        self.waypoint.dwell_s = 0.0;
        self.forget_reached();
    }

    /// Notes that the target is not reached: the ball was not sent to the newest one.
    pub(super) fn forget_reached(&mut self) {
        self.reached = None;
    }
}

/// Legs of a run, but for the one under way.
pub(super) struct Legs {
    /// Waypoints of the list that were not begun.
    waiting: VecDeque<CheckedWaypoint>,
    /// Whether a waypoint waits again once it was begun.
    is_repeated: bool,
    /// Whether a command or a fault ended the list of targets before its end.
    is_cancelled: bool,
    ended: FirstAndLast<Leg>,
    /// Number of those whose targets were reached.
    reached: usize,
    /// Number of those whose ball hung at the target already.
    already_there: usize,
}

impl Legs {
    /// Returns the legs of a run along `route`.
    pub(super) fn new(route: &Route) -> Self {
        Self {
            waiting: route.waypoints.iter().copied().collect(),
            is_repeated: route.is_repeated,
            is_cancelled: false,
            ended: FirstAndLast::default(),
            reached: 0,
            already_there: 0,
        }
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

    /// Adds a drive that ended. Returns its number, from 0. A ball that has not answered the motors
    /// has reached nothing.
    pub(super) fn end(
        &mut self,
        drive: &Drive,
        ending: StopReason,
        has_answered: bool,
        stats: &RunStats,
    ) -> usize {
        // A person who ends the leg during the dwell time does not undo the arrival.
        let was_there = drive.is_reached() && ending.is_chosen();
        let was_reached = was_there && has_answered;
        let is_there = was_there || ending == StopReason::AlreadyThere;
        self.already_there += usize::from(is_there && !was_reached);
        let leg = Leg {
            target_m: drive.waypoint.target.map(|metres| round(metres, 1e6)),
            frames: stats.frames - drive.frames_before,
            reached: was_reached || ending == StopReason::Reached,
            ending,
            filtered_error_mm: stats.error.map(millimetres),
        };
        self.reached += usize::from(leg.reached);
        self.ended.push(leg);
        self.ended.count() - 1
    }

    /// Returns the number of legs that ended.
    pub(super) fn count(&self) -> usize {
        self.ended.count()
    }

    /// Returns the number of those whose targets were reached.
    pub(super) fn reached(&self) -> usize {
        self.reached
    }

    /// Returns whether every target of the list and of the operator was reached, where no leg is
    /// under way. At some of them, but not at all, the ball may have hung already.
    pub(super) fn all_reached(&self) -> bool {
        self.reached > 0 && self.all_done()
    }

    /// As [`Self::all_reached`]; the ball may have hung at all of them.
    pub(super) fn all_done(&self) -> bool {
        let is_complete = self.waiting.is_empty() && !self.is_cancelled;
        is_complete && self.count() > 0 && self.reached + self.already_there == self.count()
    }

    /// Returns the legs that ended.
    pub(super) fn into_ended(self) -> FirstAndLast<Leg> {
        self.ended
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Waypoint;
    use plumb_protocol::message::Fault;

    fn no_route() -> Route {
        Route { waypoints: Vec::new(), is_repeated: false }
    }

    fn drive(frames_before: u64) -> Drive {
        Drive::new(Waypoint::new([0.4, 0.3, 0.2]), 0.0, frames_before)
    }

    /// Returns whether a leg counts as reached that ended for `ending` during its dwell time.
    fn is_reached_after(ending: StopReason) -> bool {
        let (mut legs, mut drive) = (Legs::new(&no_route()), drive(0));
        drive.waypoint.dwell_s = 2.0;
        drive.note_reached(1.0);
        legs.end(&drive, ending, true, &RunStats::default());
        legs.all_reached()
    }

    /// The leg number `number` takes as many frames and is reached, but for one of ten.
    #[test]
    fn of_many_legs_the_first_and_the_last_are_kept_and_all_are_counted() {
        const ALL: usize = 25_000;
        let (mut legs, mut stats) = (Legs::new(&no_route()), RunStats::default());
        for number in 0..ALL {
            let begun = drive(stats.frames);
            stats.frames += number as u64;
            let ending = if number % 10 == 0 { StopReason::Stopped } else { StopReason::Reached };
            assert_eq!(legs.end(&begun, ending, true, &stats), number);
        }
        assert!(!legs.all_reached());
        assert_eq!((legs.count(), legs.reached()), (ALL, ALL - ALL / 10));
        let kept: Vec<u64> = legs.into_ended().into_kept().iter().map(|leg| leg.frames).collect();
        let expected = (0..100).chain(ALL as u64 - 900..ALL as u64);
        assert!(kept.iter().copied().eq(expected), "{kept:?}");
    }

    #[test]
    fn a_leg_that_is_left_out_and_was_not_reached_counts() {
        let mut legs = Legs::new(&no_route());
        for number in 0..3000 {
            let missed = number == 1000;
            let ending = if missed { StopReason::Timeout } else { StopReason::Reached };
            legs.end(&drive(0), ending, true, &RunStats::default());
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
