//! Paths and targets that move, in the core of a run.

use plumb_protocol::units::Point;

use super::{Action, BoardAction, RunCore};
use crate::observer::{PathPoint, RunEvent, TargetsEvent};
use crate::run::goal::Goal;
use crate::run::path::PathDrive;
use crate::run::targets::REST_M;
use crate::run::waypoint::Waypoint;
use crate::stop_reason::StopReason;
use crate::targets::{Arrivals, MotionId};

impl RunCore {
    /// Begins to follow the path, where there is one that was not begun. Returns whether there is.
    pub(super) fn begin_path(&mut self, now: f64) -> bool {
        let Some(plan) = self.plan.take() else { return false };
        let mut path = PathDrive::new(plan, now);
        // A loop has no end: a person ends it.
        let dwell_s = if path.is_loop() { f64::INFINITY } else { 0.0 };
        let drive = self.begin_leg(Waypoint { dwell_s, ..Waypoint::new(path.end()) }, now);
        if self.board.fault.is_none()
            && let Some(reference) = path.next_message(now)
        {
            self.send(BoardAction::Follow(reference));
        }
        self.goal = Goal::Path(drive, Box::new(path));
        true
    }

    /// Takes in what the board reports of the path, and sends the next part where it is due.
    pub(super) fn follow_path(&mut self, now: f64) {
        let Goal::Path(drive, path) = &mut self.goal else { return };
        if let Some(telemetry) = self.board.about_path() {
            let sent = self.sent.named_by(telemetry).map(|position| position.time);
            path.note_telemetry(telemetry, sent, now);
            if path.is_loop() && telemetry.reference.is_some() {
                drive.note_reached(now);
            }
        }
        if self.board.fault.is_none()
            && let Some(reference) = path.next_message(now)
        {
            self.send(BoardAction::Follow(reference));
        }
    }

    /// Ends the path, begun or not: no part follows. The drive to where it was sent goes on until
    /// the answer to the command that ended the path.
    pub(super) fn cancel_path(&mut self) {
        self.plan = None;
        if let Goal::Path(drive, _) = self.goal
            && let Goal::Path(_, path) = std::mem::replace(&mut self.goal, Goal::Waypoint(drive))
        {
            self.ended_path = Some(path);
        }
    }

    /// Takes the targets that have come, begins to follow them where the board can, and sends where
    /// they go.
    pub(super) fn take_moving(&mut self, arrivals: Arrivals, is_stopped: bool, now: f64) {
        let Some(targets) = &mut self.targets else { return };
        let events = targets.take(arrivals, now);
        let has_ended = events.contains(&TargetsEvent::Ended) && targets.is_complete();
        for event in events {
            self.emit(RunEvent::Targets(event));
        }
        if is_stopped {
            // A motion that is begun while the rig is stopped never moves the ball.
            self.cancel_targets();
        }
        if self.board.fault.is_some() {
            return;
        }
        self.begin_targets(now);
        self.send_targets(now);
        if has_ended && let Goal::Moving(drive) = &mut self.goal {
            // The drive ends where the board holds the ball at the last place.
            drive.finish();
        }
    }

    /// Begins a leg with the target that moves, where one waits and the board can follow it.
    fn begin_targets(&mut self, now: f64) {
        let (Some(targets), Some(telemetry)) = (&mut self.targets, &self.board.telemetry) else {
            return;
        };
        // A jog that the board has accepted is not in its telemetry yet.
        let is_busy = self.in_flight.is_some()
            || self.board.is_answer_due
            || self.answered_at == Some(telemetry.time)
            || matches!(self.goal, Goal::Settling | Goal::Moving(_));
        let (known, sent) = (self.sent.named_by(telemetry), self.sent.newest());
        let place = targets.begin(telemetry.state, known, sent, now).filter(|_| !is_busy);
        let Some(place) = place else { return };
        targets.note_begun(now);
        let is_complete = targets.is_complete();
        self.legs.cancel_list();
        self.cancel_path();
        self.send(BoardAction::LeavePath);
        self.board.leave_path();
        self.end_leg(StopReason::Replaced);
        // A target that goes on has no end: its source or a person ends it.
        let dwell_s = if is_complete { 0.0 } else { f64::INFINITY };
        let drive = self.begin_leg(Waypoint { dwell_s, ..Waypoint::new(place.into()) }, now);
        self.goal = Goal::Moving(drive);
    }

    /// Sends where the target goes, where that is due.
    fn send_targets(&mut self, now: f64) {
        let (Goal::Moving(drive), Some(targets)) = (&mut self.goal, &mut self.targets) else {
            return;
        };
        let is_followed = self.board.about_path().is_some_and(|it| it.reference.is_some());
        if is_followed && targets.has_caught_up() && !targets.is_complete() {
            drive.note_reached(now);
        }
        let state_at_rest = self.board.about_rest().map(|telemetry| telemetry.state);
        let message = targets.next_message(state_at_rest, now);
        if let Some(message) = message {
            self.actions.list.push(Action::Board(BoardAction::Follow(message)));
        }
        if let Some(rest) = targets.rest() {
            let rest = Point::from_metres(rest.into()).map_or(rest, |at| at.to_metres().into());
            let is_new = self.target.is_none_or(|target| (rest - target).norm() > REST_M);
            if message.is_some() && is_new {
                self.actions.list.push(Action::Board(BoardAction::NoteNewRest));
            }
            self.target = Some(rest);
            drive.waypoint.target = rest.into();
        }
    }

    /// Ends the targets that move, where there are any. The drive to where the last one comes to
    /// rest goes on until the answer to the command that ended them.
    pub(super) fn cancel_targets(&mut self) {
        let Some(targets) = &mut self.targets else { return };
        targets.cancel();
        if let Goal::Moving(drive) = self.goal {
            self.goal = Goal::Waypoint(drive);
        }
        self.act(Action::EndMotions);
    }

    /// Takes in which motions were ended.
    pub(super) fn note_motions_ended(&mut self, newest: MotionId) {
        if let Some(targets) = &mut self.targets {
            targets.note_cancelled(newest);
        }
    }

    /// Returns the reason to end a run whose goal are targets that do not come: none for the
    /// timeout, none at all, or none that can be used. The drive to the last one has the timeout.
    pub(super) fn targets_reason(&mut self, now: f64) -> Option<StopReason> {
        let (is_operated, timeout) = (self.settings.is_operated, self.settings.timeout);
        let targets = self.targets.as_mut().filter(|targets| targets.is_goal() && !is_operated)?;
        if targets.is_complete() && !targets.has_taken() {
            return Some(StopReason::NoTarget);
        }
        let are_unused = targets.are_unused();
        let unused = match targets.are_refused() {
            true => StopReason::TargetsRefused,
            false => StopReason::TargetsBroken,
        };
        if targets.is_complete() && are_unused {
            return Some(unused);
        }
        if targets.is_broken() {
            return Some(StopReason::TargetsBroken);
        }
        if targets.unfollowed(now) > timeout {
            return Some(StopReason::TargetsNotFollowed);
        }
        let is_last = self.goal.is_moving() && targets.is_complete();
        let silent = match (is_last, are_unused || targets.are_refused()) {
            (true, _) => StopReason::Timeout,
            (false, true) => unused,
            (false, false) => StopReason::TargetsSilent,
        };
        (targets.silence(now) > timeout).then_some(silent)
    }

    /// Returns the time for which the run has waited for the present target, or for a path that
    /// stands still, seconds.
    pub(super) fn waited(&self, now: f64) -> f64 {
        match &self.goal {
            Goal::Path(_, path) => path.standstill(now),
            Goal::Waypoint(drive) if !drive.is_reached() => drive.elapsed(now),
            _ => 0.0,
        }
    }

    /// Returns the point of the path or of the moving target at the time `stamp` of a frame, and
    /// notes the ball's deviation from it; `None` while the board follows none.
    pub(super) fn path_point(
        &mut self,
        stamp: f64,
        ball: Option<nalgebra::Point3<f64>>,
    ) -> Option<PathPoint> {
        if let (Some(targets), Some(ball)) = (&mut self.targets, ball) {
            targets.note_ball(ball);
        }
        let telemetry = self.board.about_path()?;
        match (&mut self.goal, &mut self.targets) {
            (Goal::Path(_, path), _) => {
                let point = path.point(stamp, Some(telemetry.state))?;
                ball.inspect(|ball| path.note_position(&point, *ball));
                Some(point)
            }
            (Goal::Moving(_), Some(targets)) => {
                let point = targets.point(stamp, telemetry)?;
                ball.inspect(|ball| targets.note_position(&point, *ball));
                Some(point)
            }
            _ => None,
        }
    }
}
