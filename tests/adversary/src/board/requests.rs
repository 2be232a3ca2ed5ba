//! Requests: commands whose repetition must not be executed again.

use plumb_protocol::message::{Command, ToBoard};

/// The last executed request, to recognise its repetition.
#[derive(Debug, Default)]
pub struct Requests {
    executed: Option<ToBoard>,
}

impl Requests {
    /// Records an accepted command. A Hello starts a new session.
    pub fn record(&mut self, accepted: ToBoard) {
        if is_request(&accepted.command) {
            self.executed = Some(accepted);
        } else if matches!(accepted.command, Command::Hello(_)) {
            self.executed = None;
        }
    }

    /// Returns whether a message repeats the last executed request.
    pub fn is_repetition(&self, message: &ToBoard) -> bool {
        self.executed.as_ref() == Some(message)
    }

    /// Forgets a write to flash that has failed: it may be requested again.
    pub fn forget_write(&mut self) {
        self.executed.take_if(|executed| writes_flash(&executed.command));
    }
}

/// Returns whether a repetition of this command must not be executed again.
pub fn is_request(command: &Command) -> bool {
    match command {
        Command::Hello(_) | Command::Stop | Command::Bootloader => false,
        Command::Position(_) | Command::Status | Command::Follow(_) => false,
        Command::Diagnose | Command::Measure | Command::Wire(_) => false,
        Command::Prior(_) | Command::Rates(_) | Command::Pen(_) => false,
        Command::Configure(_) | Command::Target(_) | Command::Jog(_) => true,
        Command::Hold | Command::ClearFault | Command::Home => true,
        Command::Store | Command::TestFlash => true,
    }
}

/// Returns whether this command is answered once the flash is written.
pub fn writes_flash(command: &Command) -> bool {
    matches!(command, Command::Store | Command::TestFlash)
}
