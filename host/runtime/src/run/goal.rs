//! What the ball is to do, as far as the host knows: the state of a run.
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
//! The Stop that holds the rig is apart from the goal
//! ([`StopEvent`](crate::operator::StopEvent)): a fault and its clearing leave it.

use plumb_protocol::message::Fault;

use super::path::PathDrive;
use super::waypoint::Waypoint;

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
    /// Time of its begin.
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

    /// Returns the time since its begin.
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
    pub(super) fn come_to_an_end(&mut self) {
        (self.waypoint.dwell_s, self.reached) = (0.0, None);
    }
}
