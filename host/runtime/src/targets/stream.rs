//! Thread that reads targets of another program, or plays those of a file.

use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plumb_cameras::bounded_read::{LineError, ReadError, read_line, read_text};
use plumb_cameras::error_chain::ErrorChain;
use plumb_cameras::source::stream::{Connection, Endpoint, StreamError};
use thiserror::Error;
use tracing::{debug, info};

use super::address::TargetAddress;
use super::channel::{MotionId, TargetSender};
use super::intake::{LineIntake, Omission};
use super::line::{MAX_LINE_BYTES, TargetLine};

/// Largest file, bytes: an hour at 200 Hz.
const MAX_FILE_BYTES: u64 = 1 << 27;

/// Longest time for which the thread does not notice that it is to end.
const REACTION: Duration = Duration::from_millis(50);

/// Failure to open a stream of targets.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TargetStreamError {
    /// The address of a program cannot be used.
    #[error(transparent)]
    Program(#[from] StreamError),
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] ReadError),
    /// A line of the file is wrong.
    #[error("{}: {problem}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, and what is wrong.
        problem: String,
    },
    /// The file has no target.
    #[error("{}: has no target", .0.display())]
    Empty(PathBuf),
    /// No thread can be started.
    #[error("the targets cannot be read")]
    Thread(#[source] io::Error),
}

/// Thread that sends the targets of a program or a file to a run. Dropping it ends the thread,
/// which takes a tenth of a second at most.
#[derive(Debug)]
pub struct TargetStream {
    is_closed: Arc<AtomicBool>,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
}

/// What the thread needs.
struct Reader {
    sender: TargetSender,
    motion: MotionId,
    is_closed: Arc<AtomicBool>,
    /// Zero of the host's clock.
    zero: Instant,
}

impl TargetStream {
    /// Listens at `address`, or reads the file, and sends its targets to `sender`. A file is
    /// checked as a whole before, and begins when the run takes the first targets.
    ///
    /// # Errors
    /// Where the address cannot be used; where the file cannot be read, a line is wrong or has no
    /// `t`, or `t` does not grow.
    pub fn start(address: &TargetAddress, sender: TargetSender) -> Result<Self, TargetStreamError> {
        let is_closed = Arc::new(AtomicBool::new(false));
        let (motion, zero) = (sender.begin(), Instant::now());
        let reader = Reader { sender, motion, is_closed: Arc::clone(&is_closed), zero };
        let thread = thread::Builder::new().name("targets".to_owned());
        let thread = match address {
            TargetAddress::Program(address) => {
                let endpoint = Endpoint::listen(address)?;
                thread.spawn(move || reader.receive(&endpoint))
            }
            TargetAddress::File(path) => {
                let lines = read_file(path)?;
                thread.spawn(move || reader.play(&lines))
            }
        };
        Ok(Self { is_closed, thread: Some(thread.map_err(TargetStreamError::Thread)?) })
    }
}

impl Drop for TargetStream {
    fn drop(&mut self) {
        self.is_closed.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

/// Reads a file of targets: the lines with their times, seconds from the first one.
fn read_file(path: &Path) -> Result<Vec<(f64, TargetLine)>, TargetStreamError> {
    let text = read_text(path, MAX_FILE_BYTES)?;
    let wrong = |problem| TargetStreamError::Line { path: path.to_owned(), problem };
    let mut lines: Vec<(f64, TargetLine)> = Vec::new();
    let mut first = None;
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let at = |problem: &dyn std::fmt::Display| wrong(format!("line {number}: {problem}"));
        let line = TargetLine::parse(line).map_err(|mistake| at(&ErrorChain(&mistake)))?;
        let t = line.t.ok_or_else(|| at(&"`t` is missing: a file is read by its times"))?;
        let time = t - *first.get_or_insert(t);
        if lines.last().is_some_and(|(before, _)| time <= *before) {
            return Err(at(&"`t` must grow from line to line"));
        }
        lines.push((time, line));
    }
    if lines.is_empty() {
        return Err(TargetStreamError::Empty(path.to_owned()));
    }
    Ok(lines)
}

impl Reader {
    fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }

    /// Sends the targets of a file, each at its time.
    fn play(self, lines: &[(f64, TargetLine)]) {
        while !self.sender.is_taken() && !self.is_closed() {
            thread::sleep(Duration::from_millis(5));
        }
        let begin = Instant::now();
        for (time, line) in lines {
            let due = begin + Duration::try_from_secs_f64(*time).unwrap_or(Duration::MAX / 4);
            while let Some(left) = due.checked_duration_since(Instant::now()) {
                if self.is_closed() {
                    return;
                }
                thread::sleep(left.min(REACTION));
            }
            self.sender.send(self.motion, due, line.position(), line.velocity());
        }
        self.sender.end();
    }

    /// Receives the targets of one sender after the other, until the stream is closed or standard
    /// input ends.
    fn receive(self, endpoint: &Endpoint) {
        while !self.is_closed() {
            match endpoint.next_connection() {
                Ok(Some(file)) => {
                    info!("a sender of targets has connected");
                    self.receive_one(file, endpoint);
                    if endpoint.is_input() {
                        break;
                    }
                }
                Ok(None) => {}
                Err(error) => {
                    let problem = format!("targets cannot be received: {error}");
                    self.sender.leave_out(problem, |_| {});
                    break;
                }
            }
        }
        self.sender.end();
    }

    /// Receives the targets of one sender, until it ends.
    fn receive_one(&self, file: File, endpoint: &Endpoint) {
        let is_closed = || self.is_closed();
        let mut input = BufReader::new(Connection::new(file, endpoint, &is_closed));
        let mut intake = LineIntake::default();
        loop {
            let taken = match read_line(&mut input, MAX_LINE_BYTES) {
                Ok(Some(text)) => intake.take(&text, self.zero.elapsed().as_secs_f64()),
                Ok(None) => break,
                Err(LineError::Io(error)) => {
                    self.note_end(&error);
                    break;
                }
                Err(error) => {
                    let is_too_long = matches!(error, LineError::TooLong { .. });
                    if is_too_long && skip_line(&mut input).is_err() {
                        break;
                    }
                    Err(intake.unreadable(&error))
                }
            };
            match taken {
                Ok(Some((line, time))) => self.send(&line, time),
                Ok(None) => {}
                Err(Omission { problem, kind }) => {
                    self.sender.leave_out(problem, |left_out| kind.count(left_out));
                }
            }
        }
        debug!(lines = intake.lines(), "a sender of targets has ended");
    }

    fn send(&self, line: &TargetLine, time: f64) {
        let at = self.zero + Duration::try_from_secs_f64(time).unwrap_or_default();
        self.sender.send(self.motion, at, line.position(), line.velocity());
    }

    /// Tells why a connection ended, where its sender has not ended it.
    fn note_end(&self, error: &io::Error) {
        if !matches!(error.kind(), ErrorKind::Other | ErrorKind::ConnectionReset) {
            self.sender.leave_out(format!("targets cannot be received: {error}"), |_| {});
        }
    }
}

/// Skips the rest of a line.
fn skip_line(input: &mut impl BufRead) -> io::Result<()> {
    loop {
        let bytes = input.fill_buf()?;
        if bytes.is_empty() {
            return Ok(());
        }
        let end = bytes.iter().position(|&byte| byte == b'\n');
        let count = end.map_or(bytes.len(), |end| end + 1);
        input.consume(count);
        if end.is_some() {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests;
