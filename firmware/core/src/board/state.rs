//! What the board is doing, and the transitions that do not depend on anything else.

use plumb_protocol::message::{self, Fault};
use plumb_protocol::units::{Micros, Point};

use super::session::RequestKey;
use crate::plan::Jogging;

/// State of the board. The [module's front page](super) draws the transitions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    /// The board has no configuration.
    Unconfigured,
    /// The board is configured and its motors stand.
    Ready,
    /// One motor turns by an exact number of steps.
    Jogging(Jogging),
    /// The servo drives the ball to a target.
    Seeking(Goal),
    /// The target was reached, and the servo keeps the ball there.
    Holding(Goal),
    /// The servo has the ball follow a reference. The goal is where that is at present.
    Following(Goal),
    /// The motors ramp down for a Hold, and then stand until the ball has come to rest.
    /// [`Holding`](Self::Holding) follows.
    Settling(Settling),
    /// The motors ramp down. With [`AfterStop::Bootloader`] also what follows: the board waits for
    /// its restart.
    Stopping {
        /// What follows.
        then: AfterStop,
    },
    /// The chip writes its flash; the motors stand.
    Storing {
        /// The write, whose command is answered once it is done.
        job: FlashJob,
        /// What follows.
        then: AfterStop,
    },
    /// The board has stopped by itself: it ramps down or stands until the fault is cleared.
    Fault {
        /// Why it has stopped.
        fault: Fault,
        /// Write to flash that goes on meanwhile.
        storing: Option<FlashJob>,
        /// What follows; [`AfterStop::Ready`] only once the fault is cleared.
        then: AfterStop,
    },
}

/// What the chip does with its flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashTask {
    /// Write wiring and configuration.
    Store,
    /// Test a sector that holds nothing.
    Test,
}

/// A write to flash that a command has asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FlashJob {
    /// The command.
    pub(super) request: RequestKey,
    pub(super) task: FlashTask,
}

/// A Hold that waits for the ball to come to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Settling {
    /// Id of the Hold command; `None` where that was of an earlier session.
    pub(super) command: Option<u16>,
    /// Capture time of the newest position that is counted.
    captured: Option<Micros>,
    /// Positions that are still to come at standstill.
    left: u8,
}

impl Settling {
    /// Positions at standstill: the filter, which goes a quarter of the way with each, is then
    /// within a tenth of its lag.
    const POSITIONS: u8 = 8;

    /// Begins the wait of Hold command `id`.
    pub(super) fn new(id: u16) -> Self {
        Self { command: Some(id), captured: None, left: Self::POSITIONS }
    }

    /// Takes in whether the motors turn, and when the newest position was `captured`. Returns
    /// whether the ball has come to rest.
    pub(super) fn update(&mut self, moving: bool, captured: Option<Micros>) -> bool {
        if moving {
            self.left = Self::POSITIONS;
        } else if captured != self.captured {
            self.left = self.left.saturating_sub(1);
        }
        self.captured = captured;
        self.left == 0
    }
}

/// What follows once the motors stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AfterStop {
    /// [`State::Ready`].
    Ready,
    /// A restart into the chip's bootloader.
    Bootloader,
}

/// Target of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Goal {
    /// Where the ball is to go.
    pub(super) target: Point,
    /// Id of the command that set the target; `None` where that was of an earlier session.
    pub(super) command: Option<u16>,
}

impl State {
    /// Returns the target while the servo drives the motors.
    pub(super) fn goal(&self) -> Option<&Goal> {
        match self {
            Self::Seeking(goal) | Self::Holding(goal) | Self::Following(goal) => Some(goal),
            _ => None,
        }
    }

    /// Forgets which command has set the target.
    pub(super) fn forget_command(&mut self) {
        match self {
            Self::Seeking(goal) | Self::Holding(goal) | Self::Following(goal) => {
                goal.command = None;
            }
            Self::Settling(settling) => settling.command = None,
            _ => {}
        }
    }

    /// Returns the write to flash that is under way.
    pub(super) fn flash_job(&self) -> Option<FlashJob> {
        match *self {
            Self::Storing { job, .. } => Some(job),
            Self::Fault { storing, .. } => storing,
            _ => None,
        }
    }

    /// Checks whether the board restarts into the bootloader as soon as the motors stand.
    pub(super) fn leaves(&self) -> bool {
        matches!(
            self,
            Self::Stopping { then: AfterStop::Bootloader }
                | Self::Fault { storing: None, then: AfterStop::Bootloader, .. }
        )
    }

    /// Checks whether the board needs positions: it drives the ball, or waits for it to come to
    /// rest.
    pub(super) fn needs_positions(&self) -> bool {
        matches!(self, Self::Seeking(_) | Self::Holding(_) | Self::Following(_) | Self::Settling(_))
    }

    /// Checks whether a command that moves the motors is under way.
    pub(super) fn is_driven(&self) -> bool {
        matches!(self, Self::Jogging(_)) || self.needs_positions()
    }

    /// Returns the state after Stop.
    pub(super) fn stopped(self) -> Self {
        if self.is_driven() { Self::Stopping { then: AfterStop::Ready } } else { self }
    }

    /// Returns the state after Bootloader. What is under way ends first.
    pub(super) fn leaving(self) -> Self {
        let then = AfterStop::Bootloader;
        match self {
            Self::Storing { job, .. } => Self::Storing { job, then },
            Self::Fault { fault, storing, .. } => Self::Fault { fault, storing, then },
            _ => Self::Stopping { then },
        }
    }

    /// Returns the state after `fault`. A fault before it is replaced.
    pub(super) fn faulted(self, fault: Fault) -> Self {
        let (storing, then) = match self {
            Self::Stopping { then } => (None, then),
            Self::Storing { job, then } => (Some(job), then),
            Self::Fault { storing, then, .. } => (storing, then),
            _ => (None, AfterStop::Ready),
        };
        Self::Fault { fault, storing, then }
    }

    /// Returns the state while the chip does `job`.
    pub(super) fn storing(self, job: FlashJob) -> Self {
        match self {
            Self::Fault { fault, then, .. } => Self::Fault { fault, storing: Some(job), then },
            _ => Self::Storing { job, then: AfterStop::Ready },
        }
    }

    /// Returns the state once the flash is written, or that has failed.
    pub(super) fn stored(self) -> Self {
        match self {
            Self::Storing { then: AfterStop::Ready, .. } => Self::Ready,
            Self::Storing { then, .. } => Self::Stopping { then },
            Self::Fault { fault, then, .. } => Self::Fault { fault, storing: None, then },
            other => other,
        }
    }

    /// Returns the state as telemetry and refusals name it.
    pub(super) fn on_wire(&self) -> message::State {
        match self {
            Self::Unconfigured => message::State::Unconfigured,
            Self::Ready => message::State::Ready,
            Self::Jogging(_) => message::State::Jogging,
            Self::Seeking(_) => message::State::Seeking,
            Self::Holding(_) => message::State::Holding,
            Self::Following(_) => message::State::Following,
            Self::Settling(_) | Self::Stopping { .. } => message::State::Stopping,
            Self::Storing { .. } => message::State::Storing,
            Self::Fault { fault, .. } => message::State::Fault(*fault),
        }
    }
}
