//! Inputs and actions of the core of a run.

use std::sync::Arc;
use std::time::Duration;

use plumb_frame::detect::DetectError;
use plumb_frame::frame::RgbdFrame;
use plumb_frame::observation::{BallObservation, Gaussian3, TwoDepths};
use plumb_protocol::message::{Command, Reference};
use plumb_protocol::units::{Covariance, Point};

use crate::link::{LinkView, Reply};
use crate::observer::{EventRecord, FrameRecord};
use crate::operator::{StopEvent, Submitted};
use crate::run::error::ControlLoopError;
use crate::run::plausibility::Sight;
use crate::stop_reason::StopReason;
use crate::targets::{Arrivals, MotionId};

/// What happened to a run.
pub(in crate::run) enum Input {
    /// The run begins. A Stop may hold already.
    Begin {
        /// Whether a Stop of the operator holds, or waits.
        is_stopped: bool,
    },
    /// A command of the operator.
    Operator(Submitted),
    /// A command that a later Stop or End replaced before it was taken.
    Replaced(Submitted),
    /// A Stop is in force, or a Resume has ended it.
    Stop(StopEvent),
    /// A frame, and the ball in it.
    Picture(Picture),
    /// A frame was lost.
    FrameLost(ControlLoopError),
    /// The source has no more frames.
    EndOfFrames,
    /// The messages of the board were taken in.
    Board {
        /// What the link knows of the board.
        view: LinkView,
        /// Answer to the operator's last command.
        reply: Option<Reply>,
    },
    /// What has come from the source of targets that move.
    Moving {
        /// Targets and messages.
        arrivals: Arrivals,
        /// Whether a Stop of the operator holds, or waits.
        is_stopped: bool,
    },
    /// The motions up to this one were ended, after [`Action::EndMotions`].
    MotionsEnded(MotionId),
    /// The messages of this round are on their way, or the link broke before.
    Sent(LinkView),
    /// The end of a round.
    Tick {
        /// Whether the camera repeats one picture.
        is_repeating: bool,
    },
    /// The run is interrupted from outside.
    Interrupt,
    /// The run has ended. The commands were not taken.
    Closed(Vec<Submitted>),
    /// The link, the camera or an observer failed, for this reason.
    Failed(StopReason),
}

/// What is to be done after a step, in this order.
#[derive(Default)]
pub(in crate::run) struct Actions {
    /// Actions.
    pub(in crate::run) list: Vec<Action>,
    /// How the run ends, where it does.
    pub(in crate::run) ending: Option<Result<StopReason, ControlLoopError>>,
}

/// Something for the link to the board.
pub(in crate::run) enum BoardAction {
    /// Tells the board where the ball is.
    Position {
        /// Place of the ball; `None` where it is unknown.
        ball: Option<Point>,
        /// Covariance of the place.
        covariance: Option<Covariance>,
        /// Age of the picture.
        age: Duration,
    },
    /// Asks the board for a target.
    Target(Point),
    /// Sends the operator's command, or the run's own Stop.
    Submit(Command),
    /// Sends the next part of a path.
    Follow(Reference),
    /// Gives up the path that was sent.
    LeavePath,
    /// Notes that the last part of the path comes to rest at another place than those before.
    NoteNewRest,
}

/// Action after a step.
#[allow(clippy::large_enum_variant, reason = "a step has a few, and none is kept")]
pub(in crate::run) enum Action {
    /// Is for the board.
    Board(BoardAction),
    /// Ends the motions that were begun until now; [`Input::MotionsEnded`] follows.
    EndMotions,
    /// Tells the observers.
    Event(EventRecord),
    /// Gives the observers the record of a frame.
    Record(Box<FrameRecord>),
}

/// A frame and the ball in it.
pub(in crate::run) struct Picture {
    /// The frame.
    pub(in crate::run) frame: Arc<RgbdFrame>,
    /// The ball; `None` where it was not found.
    pub(in crate::run) ball: Option<BallObservation>,
    /// The two depths of what looks like the ball by its colours, where no ball was found.
    pub(in crate::run) rejected: Option<TwoDepths>,
    /// Whether the frame shows another ball.
    pub(in crate::run) has_rival: bool,
    /// Error of the detector, if it could not search the frame.
    pub(in crate::run) error: Option<DetectError>,
}

impl Picture {
    /// Returns the ball's position and covariance; `None` if they are unknown.
    pub(super) fn position(&self) -> Option<Gaussian3> {
        self.ball.and_then(|ball| ball.position)
    }

    /// Returns what the picture says about the ball.
    pub(super) fn sight(&self) -> Sight {
        Sight {
            position: self.position(),
            depths: self.ball.and_then(|ball| ball.depths),
            rejected: self.rejected,
            has_rival: self.has_rival,
        }
    }

    /// Returns the ball's position for the board; `None` if it is unknown.
    pub(super) fn point(&self) -> Option<Point> {
        self.position().and_then(|position| Point::from_metres(position.mean.into()))
    }

    /// Returns the covariance of the position for the board; `None` if it is unknown.
    pub(super) fn covariance(&self) -> Option<Covariance> {
        let position = self.position()?;
        Covariance::from_metres2(position.covariance.transpose().into())
    }
}
