//! Terminal that reports each key at once.

use std::io::{self, IsTerminal, Stdin, stdin};

use nix::errno::Errno;
use nix::sys::termios::{
    LocalFlags, SetArg, SpecialCharacterIndices, Termios, tcgetattr, tcsetattr,
};
use nix::unistd;

/// Returns whether standard input is a terminal.
pub(super) fn is_terminal() -> bool {
    stdin().is_terminal()
}

/// Mode of standard input in which a key arrives without Enter and is not shown. Dropping it
/// restores the mode before.
pub(super) struct KeyMode {
    input: Stdin,
    before: Termios,
}

impl KeyMode {
    /// Begins the mode.
    ///
    /// # Errors
    /// Where standard input is no terminal.
    pub(super) fn begin() -> io::Result<Self> {
        let input = stdin();
        let before = tcgetattr(&input)?;
        let mut mode = before.clone();
        mode.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
        // A read returns at once, also without a key.
        mode.control_chars[SpecialCharacterIndices::VMIN as usize] = 0;
        mode.control_chars[SpecialCharacterIndices::VTIME as usize] = 0;
        tcsetattr(&input, SetArg::TCSANOW, &mode)?;
        Ok(Self { input, before })
    }

    /// Returns the bytes of the keys since the last call.
    ///
    /// # Errors
    /// Where the terminal is gone.
    pub(super) fn read(&self) -> io::Result<Vec<u8>> {
        let mut buffer = [0; 256];
        // Not through the buffer of `Stdin`.
        let count = match unistd::read(&self.input, &mut buffer) {
            Err(Errno::EINTR) => 0,
            read => read?,
        };
        Ok(buffer[..count].to_vec())
    }
}

impl Drop for KeyMode {
    fn drop(&mut self) {
        // A terminal that is gone needs no mode. The repetitions of a key that is held down are no
        // part of the next command.
        let _gone = tcsetattr(&self.input, SetArg::TCSAFLUSH, &self.before);
    }
}
