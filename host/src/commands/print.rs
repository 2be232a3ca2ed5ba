//! Output: results to standard output, messages for people to standard error. Neither panics when
//! nobody reads.

use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::thread;
use std::time::Duration;

use super::{Failure, failed};

/// Writes a line for people to standard error, as `eprintln!` does.
macro_rules! tell {
    ($($text:tt)*) => {
        $crate::commands::print::message(format_args!("{}\n", format_args!($($text)*)))
    };
}
pub(crate) use tell;

/// Writes `text` for people to standard error. A message that cannot be written is lost: it is no
/// result.
pub(crate) fn message(text: fmt::Arguments<'_>) {
    // One write for the whole text: messages of several programs in one terminal do not mix.
    let _lost = io::stderr().write_all(text.to_string().as_bytes());
}

/// Writes a line of results to standard output. A closed pipe is no error: its reader has all that
/// it wanted.
///
/// # Errors
/// Where it cannot be written for another reason, such as a full disk.
pub(crate) fn result(line: impl fmt::Display) -> Result<(), Failure> {
    results(line).map(|_| ())
}

/// Whether a pipe has a reader.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reader {
    /// It has one, or standard output is no pipe.
    Reads,
    /// The pipe is closed: nobody will read another line.
    Gone,
}

/// As [`result`], one of many lines: returns whether it is of use to go on.
///
/// # Errors
/// As [`result`].
pub(crate) fn results(line: impl fmt::Display) -> Result<Reader, Failure> {
    let text = format!("{line}\n");
    match Results.write_all(text.as_bytes()).and_then(|()| Results.flush()) {
        Ok(()) => Ok(Reader::Reads),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(Reader::Gone),
        Err(error) => Err(failed(format!("standard output: cannot be written: {error}"))),
    }
}

/// Standard output. A full pipe is waited for, also where its reader has set it to not block.
pub(crate) struct Results;

/// Time between two looks at a full pipe.
const LOOK: Duration = Duration::from_millis(5);

impl Write for Results {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        patiently(|| io::stdout().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        patiently(|| io::stdout().flush())
    }
}

/// Repeats `attempt` until it does not fail for want of room.
fn patiently<T>(mut attempt: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match attempt() {
            Err(error) if error.kind() == ErrorKind::WouldBlock => thread::sleep(LOOK),
            done => return done,
        }
    }
}
