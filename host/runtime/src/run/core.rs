//! The pure core of a run: one state, and one step for each input. No I/O, no thread, no clock.
//!
//! The control loop stands around it (`control_loop.rs`). In each round it gives the core what has
//! happened, and carries out the actions that the core returns:
//!
//! ```text
//! commands of the operator, Stops -> Operator, Replaced, Stop
//! a picture, or a lost one        -> Picture, FrameLost        -> the ball's position to the board
//! messages of the board           -> Board                     -> the next part of a path
//! targets that move               -> Moving                    -> where the target goes
//! what the board now knows        -> Sent                      -> the record of the frame
//! the end of the round            -> Tick                      -> the next target, or the end
//! ```

mod follow;
mod interface;
mod operator;
pub(super) mod record;

use std::time::Duration;

use nalgebra::Point3;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::observation::Gaussian3;
use plumb_protocol::message::{Command, Fault};
use plumb_protocol::units::{Micros, Steps16};
use tracing::debug;

use super::error::ControlLoopError;
use super::first_and_last::FirstAndLast;
use super::goal::{Drive, Goal, Legs};
use super::path::{PathDrive, PathPlan};
use super::plausibility::{BallSpeed, Plausibility};
use super::reached::Arrival;
use super::repetition::RepeatedPicture;
use super::sent_positions::{SentPosition, SentPositions};
use super::targets::TargetDrive;
use super::waypoint::{Route, Waypoint};
use crate::link::{LinkView, Reply};
use crate::observer::{EventKind, EventRecord, RunEvent};
use crate::operator::Submitted;
use crate::rig::MotionRules;
use crate::stop_reason::StopReason;
use crate::summary::RunStats;

pub(super) use interface::{Action, Actions, BoardAction, Input, Picture};

/// Number of lost frames in a row after which the camera counts as gone.
const MAX_LOST_IN_A_ROW: u32 = 30;

/// Settings of a run.
pub(super) struct Settings {
    /// Distance within which the board holds the ball at a target, metres.
    pub(super) radius: f64,
    /// Rules for the operator's targets.
    pub(super) rules: MotionRules,
    /// Longest drive to one target, seconds.
    pub(super) timeout: f64,
    /// Whether an operator ends the run.
    pub(super) is_operated: bool,
    pub(super) ball_speed: BallSpeed,
    /// Farthest turn of a motor without the ball.
    pub(super) following_turn: Steps16,
}

/// State of a run. Times are in seconds on the source's clock.
pub(super) struct RunCore {
    settings: Settings,
    goal: Goal,
    /// The targets that wait, and the drives that ended.
    pub(super) legs: Legs,
    /// Path that follows the list of targets and was not begun.
    plan: Option<PathPlan>,
    /// Path that has ended.
    ended_path: Option<Box<PathDrive>>,
    /// Targets that move.
    pub(super) targets: Option<TargetDrive>,
    /// Counts and measurements over all targets.
    pub(super) stats: RunStats,
    /// Present target, metres in the rig frame.
    target: Option<Point3<f64>>,
    /// Position of the ball in the last frame that shows it, metres in the rig frame.
    last_position: Option<Point3<f64>>,
    /// Positions that were sent to the board last.
    sent: SentPositions,
    /// Whether the position that is on its way has the ball; `None` where none is.
    sending: Option<bool>,
    /// Whether the board has accepted a position of the ball: its errors mean nothing before.
    knows_ball: bool,
    /// Command of the operator whose answer is due.
    in_flight: Option<Submitted>,
    /// Time of the newest telemetry when the board last answered the operator, on the board's
    /// clock: the state that it tells is older than the answer.
    answered_at: Option<Micros>,
    /// Number of frames that were lost since the last good one.
    lost_in_a_row: u32,
    /// Whether the positions can be believed.
    plausibility: Plausibility,
    /// The frame of this round.
    picture: Option<Picture>,
    /// Time of the step.
    now: f64,
    /// The events so far, but for lost frames.
    pub(super) events: FirstAndLast<EventRecord>,
    /// What the link knows of the board.
    board: LinkView,
    actions: Actions,
}

impl RunCore {
    /// Returns the state of a run along `route`, before its start. `plan` is the path that follows,
    /// and `targets` follow what moves.
    pub(super) fn new(
        settings: Settings,
        route: &Route,
        plan: Option<PathPlan>,
        targets: Option<TargetDrive>,
    ) -> Self {
        // A ball on the cables answers a quarter of the turn that stops the board.
        let answered_turn = settings.following_turn.0 / 4;
        let plausibility = Plausibility::new(settings.ball_speed, answered_turn);
        Self {
            settings,
            goal: Goal::Idle,
            legs: Legs::new(route),
            plan,
            ended_path: None,
            targets,
            stats: RunStats::default(),
            target: None,
            last_position: None,
            sent: SentPositions::default(),
            sending: None,
            knows_ball: false,
            in_flight: None,
            answered_at: None,
            lost_in_a_row: 0,
            plausibility,
            picture: None,
            now: 0.0,
            events: FirstAndLast::default(),
            board: LinkView::default(),
            actions: Actions::default(),
        }
    }

    /// Takes in what happened at `now`. Returns what is to be done.
    pub(super) fn step(&mut self, now: f64, input: Input) -> Actions {
        let before = self.goal.name();
        self.now = now;
        match input {
            Input::Begin { is_stopped } => self.begin(is_stopped, now),
            Input::Operator(submitted) => self.take_command(submitted, now),
            Input::Replaced(submitted) => self.refuse_replaced(submitted),
            Input::Stop(event) => self.note_stop(event),
            Input::Picture(picture) => self.take_picture(picture, now),
            Input::FrameLost(error) => self.take_lost_frame(error),
            Input::EndOfFrames => self.conclude(StopReason::EndOfFrames, now),
            Input::Board { view, reply } => self.take_board(view, reply, now),
            Input::Moving { arrivals, is_stopped } => self.take_moving(arrivals, is_stopped, now),
            Input::MotionsEnded(newest) => self.note_motions_ended(newest),
            Input::Sent(view) => self.record(view),
            Input::Tick { is_repeating } => self.end_round(is_repeating, now),
            Input::Interrupt => self.conclude(StopReason::Interrupted, now),
            Input::Closed(waiting) => self.close(waiting),
            Input::Failed(reason) => self.fail(reason),
        }
        if self.goal.name() != before {
            debug!(from = before, to = self.goal.name(), "the goal has changed");
        }
        std::mem::take(&mut self.actions)
    }

    /// Returns whether the operator's next command has to wait: one has no answer.
    pub(super) fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Returns whether the ball has answered the motors.
    pub(super) fn has_answered(&self) -> bool {
        self.plausibility.has_answered()
    }

    /// Returns the path that the ball followed.
    pub(super) fn path(&self) -> Option<&PathDrive> {
        self.goal.path().or(self.ended_path.as_deref())
    }

    fn begin(&mut self, is_stopped: bool, now: f64) {
        if is_stopped {
            // A Stop that came before the run leaves nothing to begin.
            self.cancel_list();
        }
        self.begin_next_target(now);
    }

    /// Requests the next target of the list. Returns whether there is one.
    fn begin_next_target(&mut self, now: f64) -> bool {
        let Some(next) = self.legs.next_waypoint() else { return false };
        self.send(BoardAction::Target(next.point));
        let drive = self.begin_leg(next.waypoint, now);
        self.goal = Goal::Waypoint(drive);
        true
    }

    /// Begins the leg to `waypoint`, whose target the board has or is asked for.
    fn begin_leg(&mut self, waypoint: Waypoint, now: f64) -> Drive {
        let (number, target) = (self.legs.count(), Point3::from(waypoint.target));
        let drive = Drive::new(waypoint, now, self.stats.frames);
        self.target = Some(target);
        self.emit(RunEvent::TargetSet { number, target });
        self.stats.error = None;
        drive
    }

    /// Ends the leg under way, if there is one.
    fn end_leg(&mut self, reason: StopReason) {
        if let Some(number) = self.take_leg(reason.clone()) {
            self.emit(RunEvent::TargetEnded { number, reason });
        }
    }

    /// Removes the leg under way and notes its end. Returns its number.
    fn take_leg(&mut self, reason: StopReason) -> Option<usize> {
        let mut drive = *self.goal.drive()?;
        if self.goal.is_moving() && self.targets.as_ref().is_some_and(TargetDrive::are_unused) {
            drive.forget_reached();
        }
        if let Goal::Path(_, path) = std::mem::replace(&mut self.goal, Goal::Idle) {
            self.ended_path = Some(path);
        }
        Some(self.legs.end(&drive, reason, self.plausibility.has_answered(), &self.stats))
    }

    /// Leaves out the targets of the list that were not begun, the path and the targets that move.
    fn cancel_list(&mut self) {
        self.legs.cancel_list();
        self.cancel_path();
        self.cancel_targets();
    }

    /// Ends the leg under way for `reason`, and the list of targets.
    fn leave_list(&mut self, reason: StopReason) {
        self.cancel_list();
        self.end_leg(reason);
    }

    /// Takes a frame: its position goes to the board.
    fn take_picture(&mut self, picture: Picture, now: f64) {
        // The board refuses an age beyond its limit.
        let age = (now - picture.frame.time()).max(0.0);
        let age = Duration::try_from_secs_f64(age).unwrap_or(Duration::MAX);
        let (ball, covariance) = (picture.point(), picture.covariance());
        let motors = self.board.telemetry.map(|telemetry| telemetry.motors.map(|at| at.0));
        let motors = motors.map(|motors| motors.steppable(0));
        let doubts = self.plausibility.update(picture.frame.time(), &picture.sight(), motors);
        for doubt in doubts {
            self.emit(RunEvent::Doubt(doubt));
        }
        self.picture = Some(picture);
        self.send_position(BoardAction::Position { ball, covariance, age }, ball.is_some());
    }

    /// Takes a lost frame: the board hears that the ball is unknown. The age has no effect then.
    fn take_lost_frame(&mut self, error: ControlLoopError) {
        self.lost_in_a_row += 1;
        if self.note_lost(error) {
            let position =
                BoardAction::Position { ball: None, covariance: None, age: Duration::ZERO };
            self.send_position(position, false);
        }
    }

    fn send_position(&mut self, position: BoardAction, has_ball: bool) {
        self.sending = Some(has_ball);
        self.send(position);
    }

    /// Counts a frame that was lost or could not be searched. Returns whether the run goes on: it
    /// ends if the camera is gone or too many frames are lost.
    fn note_lost(&mut self, error: ControlLoopError) -> bool {
        if matches!(&error, ControlLoopError::Source(error) if error.is_over()) {
            self.actions.ending = Some(Err(error));
            return false;
        }
        self.stats.lost += 1;
        if self.lost_in_a_row >= MAX_LOST_IN_A_ROW {
            self.actions.ending = Some(Err(error));
            return false;
        }
        self.emit(RunEvent::FrameLost { message: ErrorChain(&error).to_string() });
        true
    }

    /// Takes in what the board has sent.
    fn take_board(&mut self, view: LinkView, reply: Option<Reply>, now: f64) {
        self.board = view;
        if let Some(has_ball) = self.sending.take() {
            self.sent.note(SentPosition { sequence: view.sequence, time: now, has_ball });
        }
        self.take_reply(reply, now);
        self.follow_path(now);
    }

    /// Decides at the end of a round how the run goes on.
    fn end_round(&mut self, is_repeating: bool, now: f64) {
        let ball = self.picture.take().and_then(|picture| picture.position());
        if self.goal.drive().is_none() {
            self.judge_rest(now);
        } else if let Some(fault) = self.board.fault {
            // A fault after the telemetry of a held target counts.
            if fault.fault == Fault::PositionLost && is_repeating {
                let repeated = RepeatedPicture { fault: Some(fault.fault) };
                self.actions.ending = Some(Err(repeated.into()));
                return;
            }
            self.conclude(StopReason::Fault(fault), now);
        } else {
            self.judge_drive(ball, now);
        }
    }

    /// Decides about a run without a drive under way.
    fn judge_rest(&mut self, now: f64) {
        self.note_idle_fault();
        self.note_jog_end();
        self.leave_doubtful_rest();
        if let (false, Some(fault)) = (self.settings.is_operated, self.board.fault) {
            // Nobody can clear it.
            self.conclude(StopReason::Fault(fault), now);
        } else if let Some(reason) = self.targets_reason(now) {
            self.conclude(reason, now);
        }
    }

    /// Decides about the drive under way. `ball` is the measured position.
    fn judge_drive(&mut self, ball: Option<Gaussian3>, now: f64) {
        let about = if self.goal.is_moving() {
            self.board.about_rest().copied()
        } else {
            self.board.about_target().copied()
        };
        let belief = self.plausibility.arrival();
        let (Some(drive), Some(target)) = (self.goal.drive_mut(), self.target) else { return };
        let radius = self.settings.radius;
        let tolerance = drive.waypoint.tolerance_m.unwrap_or(radius);
        // Before the board knows the ball, the error in its telemetry is 0.
        let may_pass = tolerance > radius && drive.waypoint.dwell_s == 0.0 && self.knows_ball;
        let arrival = Arrival { target, tolerance, may_pass };
        if belief.is_some() && arrival.is_reached(about.as_ref(), ball) {
            drive.note_reached(now);
        }
        if self.in_flight.is_some() {
            // What the operator has sent may end the leg, and comes before the next target.
            return;
        }
        let belief = belief.filter(|_| drive.has_dwelt(now));
        if let Some(doubt) = self.plausibility.take_doubt() {
            self.conclude(StopReason::Doubt(doubt), now);
        } else if self.goal.is_moving()
            && let Some(reason) = self.targets_reason(now)
        {
            self.conclude(reason, now);
        } else if let Some(reason) = belief {
            self.conclude(reason, now);
        } else if self.waited(now) > self.settings.timeout {
            self.conclude(StopReason::Timeout, now);
        }
    }

    /// Ends the drive for `reason`: the run goes on with its next target, waits for its operator,
    /// or ends.
    fn conclude(&mut self, reason: StopReason, now: f64) {
        self.leave_rest();
        self.end_leg(reason.clone());
        let is_operated = self.settings.is_operated;
        match reason {
            StopReason::Reached | StopReason::AlreadyThere
                if self.begin_next_target(now) || self.begin_path(now) => {}
            StopReason::Reached | StopReason::AlreadyThere | StopReason::Fault(_)
                if is_operated =>
            {
                self.cancel_list();
                self.goal = match self.board.fault {
                    Some(fault) => Goal::Faulted(fault.fault),
                    None => Goal::Idle,
                };
            }
            StopReason::Timeout | StopReason::Doubt(_) if is_operated => {
                self.cancel_list();
                self.send(BoardAction::Submit(Command::Stop));
            }
            reason => self.actions.ending = Some(Ok(reason)),
        }
    }

    /// Stops the motors where the board holds the ball by positions in doubt.
    fn leave_doubtful_rest(&mut self) {
        if self.in_flight.is_none()
            && self.plausibility.take_doubt().is_some()
            && matches!(self.goal, Goal::Settling | Goal::Held)
        {
            self.leave_rest();
            self.send(BoardAction::Submit(Command::Stop));
        }
    }

    /// Ends what a Hold or a jog has begun.
    fn leave_rest(&mut self) {
        if matches!(self.goal, Goal::Settling | Goal::Held | Goal::Jogging) {
            self.goal = Goal::Idle;
        }
    }

    /// Ends the leg under way after a failure. It has no event: the summary has its message.
    fn fail(&mut self, reason: StopReason) {
        self.take_leg(reason);
    }

    fn emit(&mut self, event: RunEvent) {
        let time = self.stats.start.map_or(0.0, |start| self.now - start);
        let record = EventRecord { time, event };
        // A camera may lose pictures for days; `lost.csv` lists them.
        if record.event.kind() != EventKind::FrameLost {
            self.events.push(record.clone());
        }
        self.act(Action::Event(record));
    }

    /// Adds an action for the board.
    fn send(&mut self, action: BoardAction) {
        self.act(Action::Board(action));
    }

    fn act(&mut self, action: Action) {
        self.actions.list.push(action);
    }
}

#[cfg(test)]
mod tests;
