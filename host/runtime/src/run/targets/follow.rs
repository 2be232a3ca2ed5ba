//! Targets that move in the control loop.

use plumb_protocol::message::Telemetry;
use plumb_protocol::units::Point;

use crate::link::Transport;
use crate::observer::{PathPoint, RunEvent, TargetsEvent};
use crate::run::control_loop::ControlLoop;
use crate::run::error::ControlLoopError;
use crate::run::targets::drive::REST_M;
use crate::run::view::View;
use crate::run::waypoint::Waypoint;
use crate::stop_reason::StopReason;

impl<T: Transport> ControlLoop<'_, '_, T> {
    /// Takes the targets that have come, begins to follow them where the board can, and sends where
    /// they go.
    ///
    /// # Errors
    /// Where the link is lost.
    pub(in crate::run) fn follow_targets(&mut self) -> Result<(), ControlLoopError> {
        let now = self.parts.source.now();
        let Some(targets) = &mut self.targets else { return Ok(()) };
        let events = targets.take(now);
        let has_ended = events.contains(&TargetsEvent::Ended) && targets.is_complete();
        for event in events {
            self.emit(&RunEvent::Targets(event));
        }
        if self.is_stopped() {
            // A motion that is begun while the rig is stopped never moves the ball.
            self.cancel_targets();
        }
        if self.link.fault().is_some() {
            return Ok(());
        }
        self.begin_targets(now);
        self.send_targets(now)?;
        if has_ended {
            self.drive_to_the_last();
        }
        Ok(())
    }

    /// Begins a leg with the target that moves, where one waits and the board can follow it.
    fn begin_targets(&mut self, now: f64) {
        let is_busy = self.in_flight.is_some() || self.is_settling || self.link.is_answer_due();
        let (Some(targets), Some(telemetry)) = (&mut self.targets, self.link.telemetry()) else {
            return;
        };
        // A jog that the board has accepted is not in its telemetry yet.
        let is_busy = is_busy || self.answered_at == Some(telemetry.time);
        let (state, position) = (telemetry.state, self.sent.named_by(telemetry));
        let place = targets.begin(state, position, now).filter(|_| !is_busy);
        let Some(place) = place else { return };
        targets.note_begun(now);
        let is_complete = targets.is_complete();
        self.legs.cancel_list();
        self.cancel_path();
        self.link.leave_path();
        self.end_leg(StopReason::Replaced);
        // A target that goes on has no end: its source or a person ends it.
        let dwell_s = if is_complete { 0.0 } else { f64::INFINITY };
        self.begin_leg(Waypoint { dwell_s, ..Waypoint::new(place.into()) });
    }

    /// Sends where the target goes, where that is due.
    fn send_targets(&mut self, now: f64) -> Result<(), ControlLoopError> {
        let Some(targets) = &mut self.targets else { return Ok(()) };
        if !targets.is_following() {
            return Ok(());
        }
        let telemetry = self.link.path_telemetry().copied();
        if telemetry.is_some_and(|telemetry| telemetry.reference.is_some())
            && !targets.is_complete()
        {
            self.legs.note_reached(now);
        }
        let state_at_rest = self.link.rest_telemetry().map(|telemetry| telemetry.state);
        let message = targets.next_message(state_at_rest, now);
        if let Some(message) = message {
            self.link.follow(message)?;
        }
        if let Some(rest) = targets.rest() {
            let rest = Point::from_metres(rest.into()).map_or(rest, |at| at.to_metres().into());
            if message.is_some() && (rest - self.target).norm() > REST_M {
                self.link.note_new_rest();
            }
            self.target = rest;
            self.legs.move_target(rest.into());
        }
        Ok(())
    }

    /// Has the leg of the target that moved end where the board holds the ball at the last place.
    fn drive_to_the_last(&mut self) {
        if self.targets.as_ref().is_some_and(|targets| targets.is_following()) {
            self.legs.come_to_an_end();
        }
    }

    /// Returns the target at the time `stamp` of a frame, seconds on the source's clock, and notes
    /// the ball's deviation from it; `None` while the board follows none.
    pub(in crate::run) fn target_point(&mut self, stamp: f64, view: &View) -> Option<PathPoint> {
        let targets = self.targets.as_mut()?;
        if let Some(position) = view.position() {
            targets.note_ball(position.mean);
        }
        let telemetry = self.link.path_telemetry().copied()?;
        let point = targets.point(stamp, &telemetry)?;
        if let Some(position) = view.position() {
            targets.note_position(&point, position.mean);
        }
        Some(point)
    }

    /// Returns the reason to end a run whose goal are targets that do not come: none for the
    /// timeout, or none at all.
    pub(in crate::run) fn targets_reason(&mut self, now: f64) -> Option<StopReason> {
        let (is_operated, timeout) = (self.is_operated(), self.parts.timeout);
        let targets = self.targets.as_mut().filter(|targets| targets.is_goal() && !is_operated)?;
        if targets.is_complete() && !targets.has_taken() {
            return Some(StopReason::NoTarget);
        }
        (targets.silence(now) > timeout).then_some(StopReason::Timeout)
    }

    /// Returns the time since the last target, seconds, while the board follows; 0 with an
    /// operator, who ends the wait. `None` where the board follows none.
    pub(in crate::run) fn targets_waited(&mut self, now: f64) -> Option<f64> {
        let is_operated = self.is_operated();
        let targets = self.targets.as_mut().filter(|targets| targets.is_following())?;
        Some(if is_operated { 0.0 } else { targets.silence(now) })
    }

    /// Returns the newest telemetry about the place where the target is or comes to rest.
    pub(in crate::run) fn telemetry_at_rest(&self) -> Option<&Telemetry> {
        match &self.targets {
            Some(targets) if targets.is_following() => self.link.rest_telemetry(),
            _ => self.link.target_telemetry(),
        }
    }

    /// Ends the targets that move, where there are any.
    pub(in crate::run) fn cancel_targets(&mut self) {
        if let Some(targets) = &mut self.targets {
            targets.cancel();
        }
    }
}
