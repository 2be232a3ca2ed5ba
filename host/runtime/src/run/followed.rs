//! The path of a run in the control loop.

use super::control_loop::ControlLoop;
use super::error::ControlLoopError;
use super::view::View;
use super::waypoint::Waypoint;
use crate::link::Transport;
use crate::observer::PathPoint;

impl<T: Transport> ControlLoop<'_, '_, T> {
    /// Begins to follow the path, where there is one that was not begun. Returns whether there is.
    ///
    /// # Errors
    /// Where the link is lost.
    pub(super) fn begin_path(&mut self) -> Result<bool, ControlLoopError> {
        let now = self.parts.source.now();
        let Some(path) = self.path.as_mut().filter(|path| path.is_waiting()) else {
            return Ok(false);
        };
        path.begin(now);
        let (end, is_loop) = (path.end(), path.is_loop());
        // A loop has no end: a person ends it.
        let dwell_s = if is_loop { f64::INFINITY } else { 0.0 };
        self.begin_leg(Waypoint { dwell_s, ..Waypoint::new(end) });
        self.follow_path()?;
        Ok(true)
    }

    /// Sends the next part of the path where it is due, and takes in what the board reports.
    ///
    /// # Errors
    /// Where the link is lost.
    pub(super) fn follow_path(&mut self) -> Result<(), ControlLoopError> {
        let now = self.parts.source.now();
        let Some(path) = &mut self.path else { return Ok(()) };
        if let Some(telemetry) = self.link.path_telemetry().copied() {
            let sent = self.sent.named_by(&telemetry).map(|position| position.time);
            path.note_telemetry(&telemetry, sent, now);
            if path.is_loop() && telemetry.reference.is_some() {
                self.legs.note_reached(now);
            }
        }
        if self.link.fault().is_none()
            && let Some(reference) = path.next_message(now)
        {
            self.link.follow(reference)?;
        }
        Ok(())
    }

    /// Returns the point of the path at the time `stamp` of a frame, seconds on the source's clock,
    /// and notes the ball's deviation from it; `None` while the board follows none.
    pub(super) fn path_point(&mut self, stamp: f64, view: &View) -> Option<PathPoint> {
        let state = self.link.path_telemetry().map(|telemetry| telemetry.state);
        let path = self.path.as_mut()?;
        let point = path.point(stamp, state)?;
        if let Some(position) = view.position() {
            path.note_position(&point, position.mean);
        }
        Some(point)
    }

    /// Returns the time for which the run has waited for the present target, for a path that stands
    /// still, or for the next of the targets that move, seconds.
    pub(super) fn waited(&mut self, now: f64) -> f64 {
        if let Some(waited) = self.targets_waited(now) {
            return waited;
        }
        let standstill = self.path.as_ref().and_then(|path| path.standstill(now));
        let waited = || if self.legs.is_reached() { 0.0 } else { self.legs.elapsed(now) };
        standstill.unwrap_or_else(waited)
    }

    /// Leaves out the targets of the list that were not begun, the path and the targets that move.
    pub(super) fn cancel_list(&mut self) {
        self.legs.cancel_list();
        self.cancel_path();
        self.cancel_targets();
    }

    /// Ends the path, where there is one.
    pub(super) fn cancel_path(&mut self) {
        if let Some(path) = &mut self.path {
            path.cancel();
        }
    }
}
