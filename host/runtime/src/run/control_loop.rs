//! The control loop: looks for the ball in every frame and reports its position to the board, until
//! the ball is at its target.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::source::SourceError;
use plumb_protocol::message::State;
use plumb_protocol::units::{Covariance, Point};
use plumb_vision::detect::DetectError;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::{BallObservation, Gaussian3};

use super::error::ControlLoopError;
use super::parts::RunParts;
use crate::error_chain::ErrorChain;
use crate::link::{Link, Transport};
use crate::observer::{FrameRecord, RunEvent};
use crate::stop_reason::StopReason;
use crate::summary::RunStats;

/// Number of lost frames in a row after which the camera counts as gone.
const MAX_LOST_IN_A_ROW: u32 = 30;

/// Largest distance of the measured position from a reached target, in radii of the target. The
/// noise of a single frame has room; another target is farther away.
const PLAUSIBLE_RADII: f64 = 2.0;

/// State of the control loop.
pub(super) struct ControlLoop<'a, 'p, T> {
    /// Source, detector and observers.
    pub(super) parts: &'a mut RunParts<'p>,
    /// Link to the configured board.
    pub(super) link: &'a mut Link<T>,
    /// Distance from a target within which it counts as reached, metres.
    pub(super) radius: f64,
    /// Counts and measurements over all targets.
    pub(super) stats: RunStats,
}

/// A frame and the ball in it.
struct View {
    frame: Arc<RgbdFrame>,
    ball: Option<BallObservation>,
    /// Error of the detector, if it could not search the frame.
    error: Option<DetectError>,
}

impl View {
    /// Returns the ball's position and covariance; `None` if they are unknown.
    fn position(&self) -> Option<Gaussian3> {
        self.ball.and_then(|ball| ball.position)
    }

    /// Returns the ball's position for the board; `None` if it is unknown.
    fn point(&self) -> Option<Point> {
        self.position().and_then(|position| Point::from_metres(position.mean.into()))
    }

    /// Returns the covariance of the position for the board; `None` if it is unknown.
    fn covariance(&self) -> Option<Covariance> {
        let position = self.position()?;
        Covariance::from_metres2(position.covariance.transpose().into())
    }
}

impl<T: Transport> ControlLoop<'_, '_, T> {
    /// Drives the ball to target `number` until it is there or the timeout is over.
    ///
    /// # Errors
    /// Where the link, the camera or an observer fails.
    pub(super) fn drive_to(
        &mut self,
        number: usize,
        target: Point,
    ) -> Result<StopReason, ControlLoopError> {
        let goal = Point3::from(target.to_metres());
        self.link.request_target(target)?;
        self.emit(&RunEvent::TargetSet { number, target: goal });
        self.stats.error = None;
        let begin = self.parts.source.now();
        self.stats.start.get_or_insert(begin);
        let reason = self.follow_frames(goal, begin)?;
        self.emit(&RunEvent::TargetEnded { number, reason: reason.clone() });
        Ok(reason)
    }

    /// Handles one frame after the other until the drive to `target`, begun at the time `begin`,
    /// ends.
    fn follow_frames(
        &mut self,
        target: Point3<f64>,
        begin: f64,
    ) -> Result<StopReason, ControlLoopError> {
        let mut lost_in_a_row = 0;
        loop {
            if self.parts.interrupted.load(Ordering::Relaxed) {
                return Ok(StopReason::Interrupted);
            }
            let mut view = match self.look() {
                Ok(Some(view)) => Some(view),
                Ok(None) => return Ok(StopReason::EndOfFrames),
                Err(error) => {
                    lost_in_a_row += 1;
                    self.note_lost(error.into(), lost_in_a_row)?;
                    None
                }
            };
            let reported = self.report(view.as_ref());
            if let Some(view) = &view {
                self.record(view, target);
            }
            reported?;
            if let Some(view) = &mut view {
                lost_in_a_row = if view.error.is_some() { lost_in_a_row + 1 } else { 0 };
                if let Some(error) = view.error.take() {
                    self.note_lost(error.into(), lost_in_a_row)?;
                }
            }
            if let Some(reason) = self.stop_reason(view.as_ref(), target)? {
                return Ok(reason);
            }
            if self.parts.source.now() - begin > self.parts.timeout {
                return Ok(StopReason::Timeout);
            }
        }
    }

    /// Takes the next frame and looks for the ball in it; `None` where there are no more.
    fn look(&mut self) -> Result<Option<View>, SourceError> {
        let Some(frame) = self.parts.source.next_frame()? else { return Ok(None) };
        let (ball, error) = match self.parts.detector.detect(&frame) {
            Ok(ball) => (ball, None),
            Err(error) => (None, Some(error)),
        };
        Ok(Some(View { frame: Arc::new(frame), ball, error }))
    }

    /// Counts a frame that was lost or could not be searched. Returns the error if the camera is
    /// gone or too many frames are lost.
    fn note_lost(
        &mut self,
        error: ControlLoopError,
        lost_in_a_row: u32,
    ) -> Result<(), ControlLoopError> {
        if matches!(&error, ControlLoopError::Source(error) if error.is_over()) {
            return Err(error);
        }
        self.stats.lost += 1;
        if lost_in_a_row >= MAX_LOST_IN_A_ROW {
            return Err(error);
        }
        self.emit(&RunEvent::FrameLost { message: ErrorChain(&error).to_string() });
        Ok(())
    }

    /// Reports the ball's position to the board, or that it is unknown: the frame shows no ball, or
    /// was lost (its age is then 0 and has no effect). Receives the board's messages.
    fn report(&mut self, view: Option<&View>) -> Result<(), ControlLoopError> {
        let age = view.map_or(0.0, |view| self.parts.source.now() - view.frame.time());
        // The board refuses an age beyond its limit.
        let age = Duration::try_from_secs_f64(age.max(0.0)).unwrap_or(Duration::MAX);
        let (ball, covariance) = view.map_or((None, None), |v| (v.point(), v.covariance()));
        self.link.position(ball, covariance, age)?;
        Ok(self.link.poll()?)
    }

    /// Counts a frame and gives its record to the observers.
    fn record(&mut self, view: &View, target: Point3<f64>) {
        let stats = &mut self.stats;
        stats.time = view.frame.time() - stats.start.unwrap_or_default();
        stats.located += u64::from(view.point().is_some());
        let about_target = self.link.target_telemetry();
        if let Some(telemetry) = about_target
            && matches!(telemetry.state, State::Seeking | State::Holding)
            && stats.located > 0
        {
            stats.error = Some(telemetry.filtered_error.to_si());
        }
        let record = FrameRecord {
            number: stats.frames,
            time: stats.time,
            frame: Some(Arc::clone(&view.frame)),
            observation: view.ball,
            target,
            telemetry: self.link.telemetry().copied(),
            state: about_target.map(|telemetry| telemetry.state),
        };
        stats.frames += 1;
        for observer in self.parts.observers.iter_mut() {
            observer.frame(&record);
        }
    }

    /// Returns the reason to end the drive to `target` after a frame, if there is one.
    fn stop_reason(
        &mut self,
        view: Option<&View>,
        target: Point3<f64>,
    ) -> Result<Option<StopReason>, ControlLoopError> {
        let mut failures = self.parts.observers.iter_mut().filter_map(|o| o.failure());
        if let Some(error) = failures.next() {
            return Err(ControlLoopError::Observer(error));
        }
        // A fault after the telemetry of a held target counts.
        if let Some(fault) = self.link.fault() {
            return Ok(Some(StopReason::Fault(fault)));
        }
        let reached = view.is_some_and(|view| self.is_reached(view, target));
        Ok(reached.then_some(StopReason::Reached))
    }

    /// Returns whether the target is reached: the board holds this target and no other, its error
    /// is within the radius, and the measured position is near the target.
    fn is_reached(&self, view: &View, target: Point3<f64>) -> bool {
        let held = self.link.target_telemetry().is_some_and(|telemetry| {
            telemetry.state == State::Holding && telemetry.filtered_error.to_si() <= self.radius
        });
        let near =
            |position: Gaussian3| (position.mean - target).norm() <= PLAUSIBLE_RADII * self.radius;
        held && view.position().is_some_and(near)
    }

    fn emit(&mut self, event: &RunEvent) {
        for observer in self.parts.observers.iter_mut() {
            observer.event(event);
        }
    }
}
