//! The last request that was carried out, so that a repetition is not carried out again.

use plumb_protocol::Config;
use plumb_protocol::message::{Command, Jog, ToBoard};
use plumb_protocol::units::Point;

/// Record of the last request that was carried out, of those that are carried out once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LastRequest {
    id: u16,
    content: Content,
}

/// Content of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    /// The content is the configuration in force, which [`Setup`](super::setup::Setup) holds.
    Configure,
    Target(Point),
    Jog(Jog),
    Hold,
    ClearFault,
    Store,
    Home,
    TestFlash,
}

impl LastRequest {
    /// Returns the record of a command that was carried out; `None` for one that may be carried out
    /// any number of times.
    pub(super) fn of(message: &ToBoard) -> Option<Self> {
        let content = match message.command {
            Command::Configure(_) => Content::Configure,
            Command::Target(target) => Content::Target(target),
            Command::Jog(jog) => Content::Jog(jog),
            Command::Hold => Content::Hold,
            Command::ClearFault => Content::ClearFault,
            Command::Store => Content::Store,
            Command::Home => Content::Home,
            Command::TestFlash => Content::TestFlash,
            Command::Hello(_)
            | Command::Stop
            | Command::Bootloader
            | Command::Position(_)
            | Command::Follow(_)
            | Command::Status
            | Command::Diagnose
            | Command::Measure => return None,
        };
        Some(Self { id: message.id, content })
    }

    /// Checks whether this is command `id`, which writes the flash.
    pub(super) fn writes_flash(&self, id: u16) -> bool {
        self.id == id && matches!(self.content, Content::Store | Content::TestFlash)
    }

    /// Checks whether `message` repeats this request, where `config` is in force.
    pub(super) fn is_repeated_by(&self, message: &ToBoard, config: Option<&Config>) -> bool {
        if self.id != message.id || Some(*self) != Self::of(message) {
            return false;
        }
        match &message.command {
            Command::Configure(again) => config == Some(again),
            _ => true,
        }
    }
}
