//! The control loop: looks for the ball in every frame and reports its position to the board, until
//! the targets are reached or the operator ends the run.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::source::SourceError;
use plumb_frame::observation::Gaussian3;
use plumb_protocol::message::{Command, Fault, State};
use plumb_protocol::units::Micros;
use tracing::trace;

use super::ending_after;
use super::error::ControlLoopError;
use super::event_log::log_event;
use super::legs::Legs;
use super::parts::RunParts;
use super::path::PathDrive;
use super::repetition::{RepeatedPicture, RepetitionDetector};
use super::sent_positions::{SentPosition, SentPositions};
use super::targets::TargetDrive;
use super::view::View;
use super::waypoint::{Route, Waypoint};
use crate::error_chain::ErrorChain;
use crate::link::{Link, Transport};
use crate::observer::{FrameRecord, RunEvent};
use crate::operator::Submitted;
use crate::rig::MotionRules;
use crate::stop_reason::StopReason;
use crate::summary::RunStats;

/// Longest wait for a frame. After that the loop looks after the link: a board that is silent is
/// noticed in time, at any rate of frames.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// Number of lost frames in a row after which the camera counts as gone.
const MAX_LOST_IN_A_ROW: u32 = 30;

/// Largest distance of the measured position from a reached target, in radii of the target. The
/// noise of a single frame has room; another target is farther away.
const PLAUSIBLE_RADII: f64 = 2.0;

/// State of the control loop.
pub(super) struct ControlLoop<'a, 'p, T> {
    /// Source, detector, observers and operator.
    pub(super) parts: &'a mut RunParts<'p>,
    /// Link to the configured board.
    pub(super) link: &'a mut Link<T>,
    /// Distance from a target within which it counts as reached, metres.
    pub(super) radius: f64,
    /// Rules for the operator's targets.
    pub(super) rules: &'a MotionRules,
    /// The drives to the targets.
    pub(super) legs: Legs,
    /// The path that follows the targets.
    pub(super) path: Option<PathDrive>,
    /// Targets that move.
    pub(super) targets: Option<TargetDrive>,
    /// Counts and measurements over all targets.
    pub(super) stats: RunStats,
    /// Present target, metres in the rig frame.
    pub(super) target: Point3<f64>,
    /// Position of the ball in the last frame that shows it, metres in the rig frame.
    pub(super) last_position: Option<Point3<f64>>,
    /// Positions that were sent to the board last.
    pub(super) sent: SentPositions,
    /// Whether the board has accepted a position of the ball: its errors mean nothing before.
    knows_ball: bool,
    /// Command of the operator whose answer is due.
    pub(super) in_flight: Option<Submitted>,
    /// Time of the newest telemetry when the board last answered the operator, on the board's
    /// clock: the state that it tells is older than the answer.
    pub(super) answered_at: Option<Micros>,
    /// Whether the board has accepted a Hold and does not hold the ball yet, as far as known.
    pub(super) is_settling: bool,
    /// Fault of a board that drives to no target, as reported.
    pub(super) idle_fault: Option<Fault>,
    /// Number of frames that were lost since the last good one.
    lost_in_a_row: u32,
    /// Detector of a camera that repeats one picture.
    repetition: RepetitionDetector,
}

impl<'a, 'p, T: Transport> ControlLoop<'a, 'p, T> {
    /// Returns the loop of a run along `route`.
    pub(super) fn new(
        parts: &'a mut RunParts<'p>,
        link: &'a mut Link<T>,
        radius: f64,
        rules: &'a MotionRules,
        repetition: RepetitionDetector,
        route: &Route,
    ) -> Self {
        Self {
            parts,
            link,
            radius,
            rules,
            legs: Legs::new(route),
            path: None,
            targets: None,
            stats: RunStats::default(),
            target: Point3::origin(),
            last_position: None,
            sent: SentPositions::default(),
            knows_ball: false,
            in_flight: None,
            answered_at: None,
            is_settling: false,
            idle_fault: None,
            lost_in_a_row: 0,
            repetition,
        }
    }

    /// Drives the ball through the targets, and then as the operator commands. Returns the reason
    /// of the run's end.
    ///
    /// # Errors
    /// Where the link, the camera or an observer fails.
    pub(super) fn run(&mut self) -> Result<StopReason, ControlLoopError> {
        if let Some(operator) = &self.parts.operator {
            operator.set_waker(self.parts.source.waker());
        }
        // The source has been running since it was opened.
        let skipped_before = self.parts.source.skipped();
        let result = self.drive();
        self.stats.skipped = self.parts.source.skipped() - skipped_before;
        self.close_operator();
        if let Err(error) = &result {
            // A failure has no event: the summary has its message.
            self.legs.end(ending_after(error, self.link.board_fault()), &self.stats);
        }
        result
    }

    fn drive(&mut self) -> Result<StopReason, ControlLoopError> {
        if self.is_stopped() {
            // A Stop that came before the run leaves nothing to begin.
            self.cancel_list();
        }
        self.begin_next_target()?;
        loop {
            let reason = if self.parts.interrupted.load(Ordering::Relaxed) {
                Some(StopReason::Interrupted)
            } else if self.obey()? {
                Some(StopReason::Ended)
            } else if self.parts.source.wait(MAX_WAIT) {
                self.handle_frame()?
            } else {
                self.link.keep_alive()?;
                self.receive()?;
                self.stop_reason(None)?
            };
            if let Some(reason) = reason
                && let Some(ending) = self.conclude(reason)?
            {
                return Ok(ending);
            }
        }
    }

    /// Ends the drive for `reason`. Returns the reason of the run's end; `None` where it goes on.
    fn conclude(&mut self, reason: StopReason) -> Result<Option<StopReason>, ControlLoopError> {
        self.is_settling = false;
        self.end_leg(reason.clone());
        match reason {
            StopReason::Reached if self.begin_next_target()? || self.begin_path()? => Ok(None),
            StopReason::Reached | StopReason::Fault(_) if self.is_operated() => {
                self.cancel_list();
                self.idle_fault = self.link.fault();
                Ok(None)
            }
            StopReason::Timeout if self.is_operated() => {
                self.cancel_list();
                self.link.submit(Command::Stop)?;
                Ok(None)
            }
            reason => Ok(Some(reason)),
        }
    }

    /// Requests the next target of the list. Returns whether there is one.
    fn begin_next_target(&mut self) -> Result<bool, ControlLoopError> {
        let Some(next) = self.legs.next_waypoint() else { return Ok(false) };
        self.link.request_target(next.point)?;
        self.begin_leg(next.waypoint);
        Ok(true)
    }

    /// Begins the leg to `waypoint`, whose target the board has or has been asked for.
    pub(super) fn begin_leg(&mut self, waypoint: Waypoint) {
        let target = Point3::from(waypoint.target);
        let begin = self.parts.source.now();
        let number = self.legs.begin(waypoint, begin, self.stats.frames);
        self.target = target;
        self.emit(&RunEvent::TargetSet { number, target });
        self.stats.error = None;
    }

    /// Ends the leg under way, if there is one.
    pub(super) fn end_leg(&mut self, reason: StopReason) {
        if let Some(number) = self.legs.end(reason.clone(), &self.stats) {
            self.emit(&RunEvent::TargetEnded { number, reason });
        }
    }

    /// Handles the next frame. Returns the reason to end the drive, if there is one.
    fn handle_frame(&mut self) -> Result<Option<StopReason>, ControlLoopError> {
        let mut view = match self.look() {
            Ok(Some(view)) => Some(view),
            Ok(None) => return Ok(Some(StopReason::EndOfFrames)),
            Err(error) => {
                self.lost_in_a_row += 1;
                self.note_lost(error.into())?;
                None
            }
        };
        let reported = self.report(view.as_ref());
        if let Some(view) = &view {
            self.record(view);
        }
        reported?;
        if let Some(view) = &mut view {
            self.lost_in_a_row = if view.error.is_some() { self.lost_in_a_row + 1 } else { 0 };
            if let Some(error) = view.error.take() {
                self.note_lost(error.into())?;
            }
        }
        self.stop_reason(view.as_ref())
    }

    /// Takes the next frame and looks for the ball in it; `None` where there are no more. A
    /// repeated picture is an error: it does not show where the ball is.
    fn look(&mut self) -> Result<Option<View>, SourceError> {
        let Some(frame) = self.parts.source.next_frame()? else { return Ok(None) };
        let frame = Arc::new(frame);
        let motors = self.link.telemetry().map(|telemetry| telemetry.motors);
        if self.repetition.update(&frame, motors, self.parts.source.now()) {
            let error = RepeatedPicture { fault: self.link.fault() };
            return Err(SourceError::new(error).with_stamp(frame.time()));
        }
        let (ball, error) = match self.parts.detector.detect(&frame) {
            Ok(ball) => (ball, None),
            Err(error) => (None, Some(error)),
        };
        Ok(Some(View { frame, ball, error }))
    }

    /// Counts a frame that was lost or could not be searched. Returns the error if the camera is
    /// gone or too many frames are lost.
    fn note_lost(&mut self, error: ControlLoopError) -> Result<(), ControlLoopError> {
        if matches!(&error, ControlLoopError::Source(error) if error.is_over()) {
            return Err(error);
        }
        self.stats.lost += 1;
        if self.lost_in_a_row >= MAX_LOST_IN_A_ROW {
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
        let (sequence, time) = (self.link.sequence(), self.parts.source.now());
        self.sent.note(SentPosition { sequence, time, has_ball: ball.is_some() });
        self.receive()
    }

    /// Receives the board's messages, without waiting.
    fn receive(&mut self) -> Result<(), ControlLoopError> {
        self.link.poll()?;
        self.handle_reply();
        self.follow_path()?;
        self.follow_targets()
    }

    /// Counts a frame and gives its record to the observers.
    fn record(&mut self, view: &View) {
        let stamp = view.frame.time();
        let path = self.path_point(stamp, view).or_else(|| self.target_point(stamp, view));
        let filtered_error = self.filtered_error();
        let stats = &mut self.stats;
        stats.time = stamp - *stats.start.get_or_insert(stamp);
        stats.located += u64::from(view.point().is_some());
        self.last_position = view.position().map(|position| position.mean).or(self.last_position);
        let about_target = self.link.target_telemetry();
        if about_target.is_some_and(|it| matches!(it.state, State::Seeking | State::Holding)) {
            stats.error = filtered_error.or(stats.error);
        }
        let record = FrameRecord {
            number: stats.frames,
            time: stats.time,
            frame: Some(Arc::clone(&view.frame)),
            observation: view.ball,
            target: path.map_or(self.target, |path| path.position),
            telemetry: self.link.telemetry().copied(),
            fault_cause: self.link.board_fault().and_then(|it| it.cause),
            state: about_target.map(|telemetry| telemetry.state),
            filtered_error,
            ground_truth: view.frame.ground_truth(),
            path,
        };
        stats.frames += 1;
        trace!(
            number = record.number,
            time_s = record.time,
            ball = ?record.position().map(|position| position.coords.as_slice().to_owned()),
            state = ?record.state,
            skipped = self.parts.source.skipped(),
            "handled a frame"
        );
        for observer in self.parts.observers.iter_mut() {
            observer.frame(&record);
        }
    }

    /// Returns |e| of the position that the board has filtered, metres; `None` where it has no
    /// target, or no position of the ball.
    fn filtered_error(&mut self) -> Option<f64> {
        let telemetry = self.link.telemetry()?;
        let named = self.sent.named_by(telemetry);
        self.knows_ball |= named.is_some_and(|position| position.has_ball);
        let error = telemetry.target.map(|_| telemetry.filtered_error.to_si());
        error.filter(|_| self.knows_ball)
    }

    /// Returns the reason to end the drive after a frame or a wait, if there is one.
    fn stop_reason(&mut self, view: Option<&View>) -> Result<Option<StopReason>, ControlLoopError> {
        let mut failures = self.parts.observers.iter_mut().filter_map(|o| o.failure());
        if let Some(error) = failures.next() {
            return Err(ControlLoopError::Observer(error));
        }
        if !self.legs.is_driving() {
            self.note_idle_fault();
            if let (false, Some(fault)) = (self.is_operated(), self.link.board_fault()) {
                // Nobody can clear it.
                return Ok(Some(StopReason::Fault(fault)));
            }
            let now = self.parts.source.now();
            return Ok(self.targets_reason(now));
        }
        // A fault after the telemetry of a held target counts.
        if let Some(fault) = self.link.board_fault() {
            if fault.fault == Fault::PositionLost && self.repetition.is_repeating() {
                return Err(RepeatedPicture { fault: Some(fault.fault) }.into());
            }
            return Ok(Some(StopReason::Fault(fault)));
        }
        let now = self.parts.source.now();
        if view.is_some_and(|view| self.is_reached(view)) {
            self.legs.note_reached(now);
        }
        if self.in_flight.is_some() {
            // What the operator has sent may end the leg, and comes before the next target.
            return Ok(None);
        }
        if self.legs.has_dwelt(now) {
            return Ok(Some(StopReason::Reached));
        }
        let is_late = self.waited(now) > self.parts.timeout;
        Ok(is_late.then_some(StopReason::Timeout))
    }

    /// Returns whether the target is reached: the board holds this target and no other, its error
    /// is within the tolerance, and the measured position is near the target. With a tolerance
    /// above the board's radius, the board may still drive to this target.
    fn is_reached(&self, view: &View) -> bool {
        let tolerance = self.legs.tolerance().unwrap_or(self.radius);
        let is_passing = tolerance > self.radius;
        let held = self.telemetry_at_rest().is_some_and(|telemetry| {
            (telemetry.state == State::Holding || is_passing && telemetry.state == State::Seeking)
                && telemetry.filtered_error.to_si() <= tolerance
        });
        let near = |position: Gaussian3| {
            (position.mean - self.target).norm() <= PLAUSIBLE_RADII * tolerance
        };
        held && view.position().is_some_and(near)
    }

    pub(super) fn emit(&mut self, event: &RunEvent) {
        log_event(event);
        for observer in self.parts.observers.iter_mut() {
            observer.event(event);
        }
    }
}
