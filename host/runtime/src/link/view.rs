//! What the link knows of the board at one time, for the run.

use plumb_protocol::message::Telemetry;

use super::{Link, Transport};
use crate::board_fault::BoardFault;

/// What the link knows of the board at one time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LinkView {
    /// Newest telemetry under this link's configuration.
    pub(crate) telemetry: Option<Telemetry>,
    /// What the telemetry is about.
    pub(crate) subject: Subject,
    /// Fault for which the board stopped by itself.
    pub(crate) fault: Option<BoardFault>,
    /// Whether a target or a submitted command has no answer.
    pub(crate) is_answer_due: bool,
    /// Number of the position that was sent last.
    pub(crate) sequence: u16,
}

/// What telemetry is about.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Subject {
    /// The target or the path that the board was asked for last.
    pub(crate) is_destination: bool,
    /// A path.
    pub(crate) is_path: bool,
    /// A part of the path that comes to rest where the newest one does.
    pub(crate) is_rest: bool,
}

impl LinkView {
    /// Returns the telemetry if it is about the target or the path asked for last.
    pub(crate) fn about_target(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|_| self.subject.is_destination)
    }

    /// Returns the telemetry if it is about the path that was sent last.
    pub(crate) fn about_path(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|_| self.subject.is_path)
    }

    /// Returns the telemetry if it is about a part of the path that comes to rest where the newest
    /// one does.
    pub(crate) fn about_rest(&self) -> Option<&Telemetry> {
        self.telemetry.as_ref().filter(|_| self.subject.is_rest)
    }

    /// Notes that the path was given up.
    pub(crate) fn leave_path(&mut self) {
        if self.subject.is_path {
            self.subject = Subject::default();
        }
    }
}

impl<T: Transport> Link<T> {
    /// Returns what the link knows of the board now.
    pub(crate) fn view(&self) -> LinkView {
        LinkView {
            telemetry: self.telemetry().copied(),
            subject: Subject {
                is_destination: self.target_telemetry().is_some(),
                is_path: self.path_telemetry().is_some(),
                is_rest: self.rest_telemetry().is_some(),
            },
            fault: self.fault,
            is_answer_due: self.is_answer_due(),
            sequence: self.sequence,
        }
    }
}
