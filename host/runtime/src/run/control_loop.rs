//! The control loop: the camera, the detector, the link, the operator and the observers around the
//! core of a run. It decides nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use plumb_frame::detect::BallDetector;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::observation::BallObservation;
use plumb_frame::source::{CameraSource, SourceError};
use tracing::{debug, info, trace};

use super::core::{Action, BoardAction, Input, Picture, RunCore};
use super::error::ControlLoopError;
use super::repetition::{RepeatedPicture, RepetitionDetector};
use crate::doubt::ColourSearch;
use crate::link::{Link, LinkError, Transport};
use crate::observer::{EventRecord, FrameRecord, Observer, RunEvent};
use crate::operator::{CommandOutcome, OperatorReceiver, Submitted};
use crate::stop_reason::StopReason;
use crate::targets::TargetSource;

/// Longest wait for a frame. After that the loop looks after the link: a board that is silent is
/// noticed in time, at any rate of frames.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// Longest drive to one target where nothing else is set, seconds.
pub const DEFAULT_TIMEOUT: f64 = 120.0;

/// Parts of a run besides the rig and the board.
pub struct RunParts<'a> {
    /// Source of the frames, which must be live ([`CameraSource::is_live`]).
    pub source: &'a mut dyn CameraSource,
    /// Detector of the ball.
    pub detector: &'a mut dyn BallDetector,
    /// Outputs of the run.
    pub observers: &'a mut [&'a mut dyn Observer],
    /// Commands from other threads. With an operator the run goes on until the operator ends it.
    pub operator: Option<OperatorReceiver>,
    /// Longest drive to one target, seconds.
    pub timeout: f64,
    /// Flag that ends the run when it is set from outside.
    pub interrupted: &'a AtomicBool,
}

impl<'a> RunParts<'a> {
    /// Returns the parts of a run without outputs and operator, which ends after
    /// [`DEFAULT_TIMEOUT`] without reaching a target, and which nothing interrupts. Others are set
    /// by name: `RunParts { observers: &mut [&mut log], ..parts }`.
    pub fn new(source: &'a mut dyn CameraSource, detector: &'a mut dyn BallDetector) -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        let (timeout, interrupted) = (DEFAULT_TIMEOUT, &NEVER);
        Self { source, detector, observers: &mut [], operator: None, timeout, interrupted }
    }
}

/// A run under way.
pub(super) struct ControlLoop<'a, 'p, T> {
    /// Camera, detector, observers and operator.
    parts: &'a mut RunParts<'p>,
    /// Link to the configured board.
    link: &'a mut Link<T>,
    core: RunCore,
    /// Source of targets that move.
    targets: Option<Box<dyn TargetSource>>,
    /// Detector of a camera that repeats one picture.
    repetition: RepetitionDetector,
    /// Number of pictures that were searched for another ball.
    rival_searches: u32,
    /// Search of pictures without a ball.
    colour_search: ColourSearch,
}

/// Pictures of a run that are searched for another ball.
const RIVAL_SEARCHES: u32 = 3;

/// Result of a step: the reason of the run's end, where it ends.
type Progress = Result<Option<StopReason>, ControlLoopError>;

impl<'a, 'p, T: Transport> ControlLoop<'a, 'p, T> {
    /// Returns the loop of a run that has not begun.
    pub(super) fn new(
        parts: &'a mut RunParts<'p>,
        link: &'a mut Link<T>,
        core: RunCore,
        targets: Option<Box<dyn TargetSource>>,
        repetition: RepetitionDetector,
    ) -> Self {
        let colour_search = ColourSearch::default();
        Self { parts, link, core, targets, repetition, rival_searches: 0, colour_search }
    }

    /// Returns the state of the run.
    pub(super) fn into_core(self) -> RunCore {
        self.core
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
        let mut result = self.drive();
        self.core.stats.skipped = self.parts.source.skipped() - skipped_before;
        let waiting = self.parts.operator.as_ref().map(OperatorReceiver::close);
        let closed = self.step(Input::Closed(waiting.unwrap_or_default()));
        result = result.and_then(|reason| closed.map(|_| reason));
        if let Err(error) = &result {
            let reason = error.ending(self.link.board_fault());
            self.core.step(self.parts.source.now(), Input::Failed(reason));
        }
        result
    }

    fn drive(&mut self) -> Result<StopReason, ControlLoopError> {
        let mut ending = self.step(Input::Begin { is_stopped: self.is_stopped() })?;
        loop {
            if let Some(reason) = ending {
                return Ok(reason);
            }
            ending = if self.parts.interrupted.load(Ordering::Relaxed) {
                self.step(Input::Interrupt)?
            } else if let Some(reason) = self.take_commands()? {
                Some(reason)
            } else if self.parts.source.wait(MAX_WAIT) {
                self.handle_frame()?
            } else {
                self.wait_for_frame()?
            };
        }
    }

    /// Takes the operator's commands, one after the other: the next one after the answer to the one
    /// before, a Stop at once.
    fn take_commands(&mut self) -> Progress {
        let Some(operator) = &self.parts.operator else { return Ok(None) };
        for replaced in operator.take_replaced() {
            self.step(Input::Replaced(replaced))?;
        }
        while let Some(submitted) = self.next_command() {
            if let Some(reason) = self.step(Input::Operator(submitted))? {
                return Ok(Some(reason));
            }
        }
        let events = self.parts.operator.as_ref().map(OperatorReceiver::take_stop_events);
        for event in events.into_iter().flatten() {
            self.step(Input::Stop(event))?;
        }
        Ok(None)
    }

    /// Removes and returns the operator's next command; while an answer is due, only a Stop or End.
    fn next_command(&self) -> Option<Submitted> {
        let is_busy = self.core.is_busy() || self.link.is_answer_due();
        self.parts.operator.as_ref()?.take(is_busy)
    }

    /// Returns whether a Stop of an operator holds, or waits.
    fn is_stopped(&self) -> bool {
        self.parts.operator.as_ref().is_some_and(OperatorReceiver::is_stopped)
    }

    /// Handles the next frame.
    fn handle_frame(&mut self) -> Progress {
        let input = match self.look() {
            Ok(Some(picture)) => Input::Picture(picture),
            Ok(None) => return self.step(Input::EndOfFrames),
            Err(error) => Input::FrameLost(error.into()),
        };
        let sent = self.step(input).and_then(|_| self.exchange_messages());
        // Also a frame during which the link broke is recorded.
        let recorded = self.step(Input::Sent(self.link.view()));
        sent?;
        recorded?;
        self.end_round()
    }

    /// Looks after the link while no frame comes.
    fn wait_for_frame(&mut self) -> Progress {
        self.link.keep_alive()?;
        self.exchange_messages()?;
        self.step(Input::Sent(self.link.view()))?;
        self.end_round()
    }

    /// Takes the next frame and looks for the ball in it; `None` where there are no more. A
    /// repeated picture is an error: it does not show where the ball is.
    fn look(&mut self) -> Result<Option<Picture>, SourceError> {
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
        let has_rival = ball.is_some_and(|ball| self.has_rival(&frame, &ball));
        let rejected = self.colour_search.depths(&*self.parts.detector, &frame, ball.is_some());
        Ok(Some(Picture { frame, ball, rejected, has_rival, error }))
    }

    /// Searches the first pictures of a run for another ball, until the ball has answered a motor.
    fn has_rival(&mut self, frame: &RgbdFrame, ball: &BallObservation) -> bool {
        if self.rival_searches == RIVAL_SEARCHES || self.core.has_answered() {
            return false;
        }
        self.rival_searches += 1;
        self.parts.detector.has_rival(frame, ball).unwrap_or_default()
    }

    /// Takes in what the board has sent and what has come from the targets that move, and sends
    /// what follows, without waiting.
    fn exchange_messages(&mut self) -> Result<(), ControlLoopError> {
        self.link.poll()?;
        let (view, reply) = (self.link.view(), self.link.reply());
        self.step(Input::Board { view, reply })?;
        let is_stopped = self.is_stopped();
        if let Some(targets) = &mut self.targets {
            let arrivals = targets.take(self.parts.source.now());
            self.step(Input::Moving { arrivals, is_stopped })?;
        }
        Ok(())
    }

    /// Ends a round: the core decides how the run goes on.
    fn end_round(&mut self) -> Progress {
        let mut failures = self.parts.observers.iter_mut().filter_map(|o| o.failure());
        if let Some(error) = failures.next() {
            return Err(ControlLoopError::Observer(error));
        }
        self.step(Input::Tick { is_repeating: self.repetition.is_repeating() })
    }

    /// Gives the core what has happened, and carries out what it returns. The observers hear of
    /// everything, also where the link breaks meanwhile.
    fn step(&mut self, input: Input) -> Progress {
        let actions = self.core.step(self.parts.source.now(), input);
        let mut sent = Ok(());
        for action in actions.list {
            match action {
                Action::Event(event) => self.emit(&event),
                Action::Record(record) => self.record(&record),
                Action::EndMotions => self.end_motions(),
                Action::Board(action) => sent = sent.and_then(|()| self.send(action)),
            }
        }
        sent?;
        actions.ending.transpose()
    }

    /// Carries out an action for the board.
    fn send(&mut self, action: BoardAction) -> Result<(), LinkError> {
        match action {
            BoardAction::Position { ball, covariance, age } => {
                self.link.position(ball, covariance, age)
            }
            BoardAction::Target(target) => self.link.request_target(target),
            BoardAction::Submit(command) => self.link.submit(command),
            BoardAction::Follow(reference) => self.link.follow(reference),
            BoardAction::LeavePath => {
                self.link.leave_path();
                Ok(())
            }
            BoardAction::NoteNewRest => {
                self.link.note_new_rest();
                Ok(())
            }
        }
    }

    /// Ends the motions of targets that were begun until now.
    fn end_motions(&mut self) {
        if let Some(targets) = &mut self.targets {
            let newest = targets.cancel();
            self.core.step(self.parts.source.now(), Input::MotionsEnded(newest));
        }
    }

    fn emit(&mut self, event: &EventRecord) {
        log_event(&event.event);
        for observer in self.parts.observers.iter_mut() {
            observer.event(event);
        }
    }

    fn record(&mut self, record: &FrameRecord) {
        trace!(
            number = record.number,
            time_s = record.time,
            ball = ?record.position().map(|position| position.coords.as_slice().to_owned()),
            state = ?record.state,
            skipped = self.parts.source.skipped(),
            "handled a frame"
        );
        for observer in self.parts.observers.iter_mut() {
            observer.frame(record);
        }
    }
}

/// Emits `event` of a run: at debug level where it is about a single frame, else at info level.
pub(super) fn log_event(event: &RunEvent) {
    match event {
        RunEvent::TargetSet { number, target } => {
            let target = format!("{target:.4}");
            info!(number, %target, "driving to a target");
        }
        RunEvent::TargetEnded { number, reason } => info!(number, %reason, "ended the drive"),
        RunEvent::FrameLost { message } => debug!(%message, "lost a frame"),
        RunEvent::Command { number, command, outcome: CommandOutcome::Accepted } => {
            info!(number, ?command, "carried out a command of the operator");
        }
        RunEvent::Command { number, command, outcome: CommandOutcome::Refused(reason) } => {
            info!(number, ?command, %reason, "refused a command of the operator");
        }
        RunEvent::Targets(event) => info!(%event, "targets that move"),
        RunEvent::Stop(event) => info!(%event, "stop"),
        RunEvent::Doubt(doubt) => info!(%doubt, "doubtful positions"),
        RunEvent::BoardStopped { fault } => info!(%fault, "the board stopped outside of a drive"),
    }
}
