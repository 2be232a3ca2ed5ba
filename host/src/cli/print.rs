//! Output: results to standard output, messages for people and progress to standard error. Neither
//! panics if the reader has closed the pipe. Control characters of what others wrote (names, lines
//! of files, words of the command line) are escaped: none of them reaches the terminal.

use std::fmt;
use std::io::{self, ErrorKind, IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use plumb_config::escape::escaped;
use rustix::termios::tcgetwinsize;
use serde::Serialize;
use thiserror::Error;

/// Writes a line for people to standard error, as `eprintln!` does.
macro_rules! tell {
    ($($text:tt)*) => {
        $crate::cli::print::message(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// Writes a line for people as [`tell`], but nothing with `--quiet`: for notes and good results.
macro_rules! note {
    ($($text:tt)*) => {
        if !$crate::cli::print::is_quiet() {
            tell!($($text)*);
        }
    };
}

/// Whether the command line has `--quiet`.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Leaves out notes and progress from now on where `is_quiet` is set.
pub(crate) fn set_quiet(is_quiet: bool) {
    IS_QUIET.store(is_quiet, Ordering::Relaxed);
}

/// Returns whether notes and progress are left out.
pub(crate) fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Writes `text` for people to standard error. Ignores errors: a message is no result. The unit
/// tests of the program write nothing.
pub(crate) fn message(text: fmt::Arguments<'_>) {
    if cfg!(test) {
        return;
    }
    let _lost = write_message("", &text.to_string());
}

/// Writes `text`, without a line feed, in place of the present line of the terminal. What has no
/// room in the line is left out: a second line would stay.
pub(crate) fn renew(text: fmt::Arguments<'_>) {
    let size = tcgetwinsize(io::stderr());
    let columns = size.map_or(0, |size| usize::from(size.ws_col));
    let room = columns.checked_sub(1).unwrap_or(usize::MAX);
    write_renewed(&text.to_string().chars().take(room).collect::<String>());
}

/// Writes a line as [`message`] does, in place of the present line of the terminal.
pub(crate) fn renew_line(text: fmt::Arguments<'_>) {
    write_renewed(&format!("{text}\n"));
}

fn write_renewed(text: &str) {
    if !cfg!(test) {
        let _lost = write_message("\r\x1b[2K", text);
    }
}

/// Writes a text behind the sequence `control` of the terminal to standard error.
fn write_message(control: &str, text: &str) -> io::Result<()> {
    // One write for the whole text: messages of several programs in one terminal do not mix.
    io::stderr().write_all(format!("{control}{}", escaped(text)).as_bytes())
}

/// Standard error for the questions of a dialogue.
pub(crate) struct Questions;

impl Write for Questions {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        write_message("", &String::from_utf8_lossy(bytes)).map(|()| bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Failure to write to standard output.
#[derive(Debug, Error)]
#[error("standard output: cannot be written")]
pub(crate) struct StdoutError(#[from] io::Error);

/// Writes a line of results to standard output. A closed pipe is no error: its reader needs no more
/// lines.
///
/// # Errors
/// Returns an error if writing fails for another reason, such as a full disk.
pub(crate) fn result(line: impl fmt::Display) -> Result<(), StdoutError> {
    results(line).map(|_| ())
}

/// Writes `value` as a line of JSON, where the command line asks for it.
///
/// # Errors
/// Returns the errors of [`result`].
pub(crate) fn json(is_asked: bool, value: impl Serialize) -> Result<(), StdoutError> {
    if !is_asked {
        return Ok(());
    }
    result(serde_json::to_string(&value).map_err(io::Error::from)?)
}

/// State of the reader of standard output.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reader {
    /// The pipe is open, or standard output is no pipe.
    Open,
    /// The reader has closed the pipe.
    Closed,
}

/// Writes one of many lines of results, as [`result`]. Returns whether the reader is still there.
///
/// # Errors
/// Returns the errors of [`result`].
pub(crate) fn results(line: impl fmt::Display) -> Result<Reader, StdoutError> {
    let text = escaped(&format!("{line}\n"));
    if cfg!(test) {
        return Ok(Reader::Open);
    }
    match Results.write_all(text.as_bytes()).and_then(|()| Results.flush()) {
        Ok(()) => Ok(Reader::Open),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(Reader::Closed),
        Err(error) => Err(error.into()),
    }
}

/// Standard output. A write waits while the pipe is full, also if the pipe is non-blocking.
pub(crate) struct Results;

/// Interval between two attempts to write to a full pipe.
const RETRY_INTERVAL: Duration = Duration::from_millis(5);

impl Write for Results {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        retry_while_full(|| io::stdout().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        retry_while_full(|| io::stdout().flush())
    }
}

/// Repeats `attempt` while the pipe is full.
fn retry_while_full<T>(mut attempt: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match attempt() {
            Err(error) if error.kind() == ErrorKind::WouldBlock => thread::sleep(RETRY_INTERVAL),
            done => return done,
        }
    }
}

/// Returns whether progress is shown: standard error is a terminal, and `--quiet` is absent.
pub(crate) fn is_shown() -> bool {
    stderr().is_terminal() && !is_quiet()
}

/// Prints a line, in place of the line of progress where there is one, which comes again with the
/// next text.
pub(crate) fn tell_above(text: fmt::Arguments<'_>) {
    if is_shown() {
        renew_line(text);
    } else {
        tell!("{text}");
    }
}

/// Line of progress. Dropping it removes the line.
pub(crate) struct ProgressLine {
    is_on: bool,
    /// Time of the last text; `None` where the terminal has none.
    shown: Option<Instant>,
}

impl ProgressLine {
    /// Least time between two texts: a reader sees 10 a second.
    const INTERVAL: Duration = Duration::from_millis(100);

    /// Returns a line without a text, which stays empty where `is_on` is not set.
    pub(crate) fn shown_if(is_on: bool) -> Self {
        Self { is_on, shown: None }
    }

    /// Shows `text` at `now` in place of the text before. Leaves it out where that is too new.
    pub(crate) fn show(&mut self, text: fmt::Arguments<'_>, now: Instant) {
        if self.is_due(now) {
            renew(text);
        }
    }

    /// Returns whether a text is shown at `now`, and notes it.
    fn is_due(&mut self, now: Instant) -> bool {
        let is_new = self.shown.is_some_and(|shown| now - shown < Self::INTERVAL);
        if !self.is_on || is_new {
            return false;
        }
        self.shown = Some(now);
        true
    }

    /// Removes the text: a message follows.
    pub(crate) fn clear(&mut self) {
        if self.shown.take().is_some() {
            renew(format_args!(""));
        }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_renewed_ten_times_a_second_at_most() {
        let begin = Instant::now();
        let shown = |is_on| {
            let mut line = ProgressLine::shown_if(is_on);
            (0..100).filter(|n| line.is_due(begin + *n * Duration::from_millis(10))).count()
        };
        assert_eq!((shown(true), shown(false)), (10, 0));
    }

    #[test]
    fn a_text_after_a_message_is_shown_at_once() {
        let (mut line, now) = (ProgressLine::shown_if(true), Instant::now());
        assert!(line.is_due(now) && !line.is_due(now));
        line.clear();
        assert!(line.is_due(now));
    }
}
