//! Terminal that reports each key at once.

use std::io;
use std::os::fd::BorrowedFd;

use rustix::stdio::stdin;
use rustix::termios::{
    LocalModes, OptionalActions, SpecialCodeIndex, Termios, isatty, tcgetattr, tcsetattr,
};

/// Returns whether standard input is a terminal.
pub(super) fn is_terminal() -> bool {
    isatty(stdin())
}

/// Mode of standard input in which a key arrives without Enter and is not shown. Dropping it
/// restores the mode before.
pub(super) struct KeyMode {
    before: Termios,
}

impl KeyMode {
    /// Begins the mode.
    ///
    /// # Errors
    /// Where standard input is no terminal.
    pub(super) fn begin() -> io::Result<Self> {
        let before = tcgetattr(input())?;
        let mut mode = before.clone();
        mode.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        // A read returns at once, also without a key.
        mode.special_codes[SpecialCodeIndex::VMIN] = 0;
        mode.special_codes[SpecialCodeIndex::VTIME] = 0;
        tcsetattr(input(), OptionalActions::Now, &mode)?;
        Ok(Self { before })
    }

    /// Returns the bytes of the keys since the last call.
    ///
    /// # Errors
    /// Where the terminal is gone.
    pub(super) fn read(&self) -> io::Result<Vec<u8>> {
        let mut buffer = [0; 256];
        let count = match rustix::io::read(input(), &mut buffer) {
            Err(error) if error == rustix::io::Errno::INTR => 0,
            read => read?,
        };
        Ok(buffer[..count].to_vec())
    }
}

impl Drop for KeyMode {
    fn drop(&mut self) {
        // A terminal that is gone needs no mode.
        let _gone = tcsetattr(input(), OptionalActions::Now, &self.before);
    }
}

/// Returns standard input, without the buffer of `std::io::stdin`.
fn input() -> BorrowedFd<'static> {
    stdin()
}
