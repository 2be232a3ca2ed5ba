//! Thread that reads targets of another program, or plays those of a file.

use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use plumb_cameras::camera_file::is_rig_file;
use plumb_cameras::stream::{Arrival, Connection, Endpoint, Interruption, StreamError};
use plumb_config::bounded_read::{LineError, ReadError, read_line, read_text};
use plumb_config::error_chain::ErrorChain;
use plumb_path::file::is_gcode;
use plumb_path::table::Table;
use thiserror::Error;
use tracing::{debug, info};

use super::SourceEnd;
use super::channel::{MotionId, TargetSender};
use super::intake::{
    Beginning, LineIntake, MAX_SKIPPED_BYTES, Omission, OmissionKind, SenderFault,
};
use super::line::{MAX_LINE_BYTES, TargetAddress, TargetLine};
use crate::rig::MotionRules;
use crate::run::GCODE;

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
    /// The file is one of another kind.
    #[error("{}: {is}", .path.display())]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// What it is, and where it belongs.
        is: &'static str,
    },
    /// A line of the file is wrong.
    #[error("{}:{line}: {problem}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong.
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
    file: Option<TargetFile>,
    is_closed: Arc<AtomicBool>,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
}

/// File of targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetFile {
    /// Number of its targets, at least 1.
    pub targets: usize,
    /// Time from the first one to the last one, seconds.
    pub span_s: f64,
}

/// What the thread needs.
struct Reader {
    sender: TargetSender,
    motion: MotionId,
    is_closed: Arc<AtomicBool>,
    /// Zero of the host's clock.
    zero: Instant,
}

/// End of a sender, with the reason that it gets; `None` where it has ended by itself, or with
/// the stream.
struct End(Option<String>);

impl TargetStream {
    /// Listens at `address`, or reads the file, and sends its targets to `sender`. A file is
    /// checked as a whole before, its places by `rules`, and begins when the run takes the first
    /// targets.
    ///
    /// # Errors
    /// Where the address cannot be used; where the file cannot be read, a line is wrong or has no
    /// `t`, `t` does not grow, or a place is not allowed.
    pub fn start(
        address: &TargetAddress,
        sender: TargetSender,
        rules: &MotionRules,
    ) -> Result<Self, TargetStreamError> {
        let is_closed = Arc::new(AtomicBool::new(false));
        let (motion, zero) = (sender.begin(), Instant::now());
        let reader = Reader { sender, motion, is_closed: Arc::clone(&is_closed), zero };
        let thread = thread::Builder::new().name("targets".to_owned());
        let mut file = None;
        let thread = match address {
            TargetAddress::Program(address) => {
                let endpoint = Endpoint::listen(address)?;
                thread.spawn(move || reader.receive(&endpoint))
            }
            TargetAddress::File(path) => {
                let lines = read_file(path, rules)?;
                let span_s = lines.last().map_or(0.0, |(time, _)| *time);
                file = Some(TargetFile { targets: lines.len(), span_s });
                thread.spawn(move || reader.play(&lines))
            }
        };
        let thread = Some(thread.map_err(TargetStreamError::Thread)?);
        Ok(Self { file, is_closed, thread })
    }

    /// Returns the file that is played; `None` where a program sends.
    pub fn file(&self) -> Option<TargetFile> {
        self.file
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
fn read_file(
    path: &Path,
    rules: &MotionRules,
) -> Result<Vec<(f64, TargetLine)>, TargetStreamError> {
    let text = read_text(path, MAX_FILE_BYTES)?;
    let mut lines: Vec<(f64, TargetLine)> = Vec::new();
    let mut first = None;
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let at = |problem: &dyn std::fmt::Display| TargetStreamError::Line {
            path: path.to_owned(),
            line: number,
            problem: problem.to_string(),
        };
        let line = TargetLine::parse(line).map_err(|mistake| match other_kind(&text) {
            Some(is) if lines.is_empty() => {
                TargetStreamError::OtherKind { path: path.to_owned(), is }
            }
            _ => at(&ErrorChain(&mistake)),
        })?;
        let t = line.t.ok_or_else(|| at(&"`t` is missing: a file is read by its times"))?;
        let time = t - *first.get_or_insert(t);
        if lines.last().is_some_and(|(before, _)| time <= *before) {
            return Err(at(&"`t` must grow from line to line"));
        }
        rules.check(line.position(), Vector3::zeros()).map_err(|error| {
            let [x, y, z] = line.position().into();
            at(&format_args!("[{x:.4}, {y:.4}, {z:.4}] m: {error}"))
        })?;
        lines.push((time, line));
    }
    if lines.is_empty() {
        return Err(TargetStreamError::Empty(path.to_owned()));
    }
    Ok(lines)
}

/// Returns what a file is that has no targets in JSON; `None` for any other file.
fn other_kind(text: &str) -> Option<&'static str> {
    let is_table = || !text.trim_start().starts_with(['{', '[']) && Table::of(text).columns() >= 3;
    if is_gcode(text) {
        Some(GCODE)
    } else if is_rig_file(text) {
        Some("this is a rig file, and no list of moving targets")
    } else {
        is_table().then_some("this is a list of places: give it with --waypoints, or with --path")
    }
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
        self.sender.end(SourceEnd::Complete);
    }

    /// Receives the targets of one sender after the other, until the stream is closed or standard
    /// input ends.
    fn receive(self, endpoint: &Endpoint) {
        let mut end = SourceEnd::Complete;
        while !self.is_closed() {
            match endpoint.next_arrival() {
                Ok(Some(Arrival::Sender(file))) => {
                    info!("a sender of targets has connected");
                    let of_sender = self.receive_one(file, endpoint);
                    if endpoint.is_input() {
                        end = of_sender;
                        break;
                    }
                }
                Ok(Some(Arrival::Stranger(file, stranger))) => {
                    let (problem, kind) = (stranger.to_string(), OmissionKind::Unreadable);
                    let reason = self.end(SenderFault::FirstLine, Omission { problem, kind });
                    endpoint.refuse(&file, &reason);
                }
                Ok(None) => {}
                Err(error) => {
                    let problem = format!("targets cannot be received: {error}");
                    self.sender.give_up(problem, |_| {});
                    end = SourceEnd::Broken;
                    break;
                }
            }
        }
        self.sender.end(end);
    }

    /// Receives the targets of one sender, until it ends or is ended. Returns which of them.
    fn receive_one(&self, file: File, endpoint: &Endpoint) -> SourceEnd {
        let is_closed = || self.is_closed();
        let mut input = BufReader::new(Connection::new(file, endpoint, &is_closed));
        let beginning = if endpoint.is_input() { Beginning::Banner } else { Beginning::Target };
        let mut intake = LineIntake::new(beginning);
        let end = loop {
            if let Err(end) = self.receive_line(&mut input, &mut intake) {
                break end;
            }
        };
        debug!(lines = intake.lines(), "a sender of targets has ended");
        let End(Some(reason)) = end else { return SourceEnd::Complete };
        input.get_ref().refuse(&reason);
        SourceEnd::Broken
    }

    /// Receives a line, and sends its target to the run.
    ///
    /// # Errors
    /// Where the sender has ended, or is ended.
    fn receive_line(
        &self,
        input: &mut BufReader<Connection<'_>>,
        intake: &mut LineIntake,
    ) -> Result<(), End> {
        let (omission, is_too_long) = match read_line(input, MAX_LINE_BYTES) {
            Ok(None) => return Err(End(None)),
            Ok(Some(text)) => match intake.take(&text, self.zero.elapsed().as_secs_f64()) {
                Ok(target) => {
                    target.iter().for_each(|(line, time)| self.send(line, *time));
                    return Ok(());
                }
                Err(omission) => (omission, false),
            },
            Err(LineError::Io(error)) => return Err(self.interrupted(&error)),
            Err(error) => (intake.unreadable(&error), matches!(error, LineError::TooLong { .. })),
        };
        let mut fault = intake.fault();
        if fault.is_none() && is_too_long {
            let is_skipped = skip_line(input).map_err(|error| self.interrupted(&error))?;
            fault = (!is_skipped).then_some(SenderFault::Endless);
        }
        if let Some(fault) = fault {
            return Err(End(Some(self.end(fault, omission))));
        }
        self.reject(omission);
        Ok(())
    }

    fn send(&self, line: &TargetLine, time: f64) {
        let at = self.zero + Duration::try_from_secs_f64(time).unwrap_or_default();
        self.sender.send(self.motion, at, line.position(), line.velocity());
    }

    fn reject(&self, Omission { problem, kind }: Omission) {
        self.sender.reject(problem, |left_out| kind.count(left_out));
    }

    /// Leaves a line out that ends its sender because of `fault`. Returns the reason, for people.
    fn end(&self, fault: SenderFault, Omission { problem, kind }: Omission) -> String {
        let reason = format!("{fault}: {problem}");
        let told = format!("a sender is ended: {reason}");
        self.sender.give_up(told, |left_out| kind.count(left_out));
        reason
    }

    /// Returns the end of a sender whose connection cannot be read on, and tells why where the
    /// sender has not ended it.
    fn interrupted(&self, error: &io::Error) -> End {
        let reason = match Interruption::of(error) {
            Some(Interruption::Closed) => return End(None),
            Some(interruption) => interruption.to_string(),
            None if error.kind() == ErrorKind::ConnectionReset => return End(None),
            None => format!("targets cannot be received: {error}"),
        };
        self.sender.give_up(reason.clone(), |_| {});
        End(Some(reason))
    }
}

/// Skips the rest of a line. Returns whether it has an end within [`MAX_SKIPPED_BYTES`], or the
/// input has.
fn skip_line(input: &mut impl BufRead) -> io::Result<bool> {
    let mut skipped = 0;
    while skipped <= MAX_SKIPPED_BYTES {
        let bytes = input.fill_buf()?;
        let end = bytes.iter().position(|&byte| byte == b'\n');
        let (count, has_ended) = (end.map_or(bytes.len(), |end| end + 1), bytes.is_empty());
        input.consume(count);
        if has_ended || end.is_some() {
            return Ok(true);
        }
        skipped += count;
    }
    Ok(false)
}

#[cfg(test)]
mod tests;
