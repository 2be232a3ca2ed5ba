//! Thread that reads targets of another program, or plays those of a file.

use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use plumb_cameras::stream::{
    Arrival, Connection, Endpoint, Interruption, StreamAddress, StreamError,
};
use plumb_config::bounded_read::{LineError, read_line};
use thiserror::Error;
use tracing::{debug, info};

use super::channel::TargetSender;
use super::intake::{
    Beginning, LineIntake, MAX_SKIPPED_BYTES, Omission, OmissionKind, SenderFault,
};
use super::line::{MAX_LINE_BYTES, TargetLine};
use super::source::{MotionId, SourceEnd};

/// Longest time for which the thread does not notice that it is to end.
const REACTION: Duration = Duration::from_millis(50);

/// Failure to open a stream of targets.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TargetStreamError {
    /// The address of a program cannot be used.
    #[error(transparent)]
    Program(#[from] StreamError),
    /// No thread can be started.
    #[error("the targets cannot be read")]
    Thread(#[source] io::Error),
}

/// Where the targets that move come from.
#[derive(Debug, Clone, PartialEq)]
pub enum TargetOrigin {
    /// A program that sends them.
    Program(StreamAddress),
    /// Targets of a file, which are played by their times.
    File(Vec<FileTarget>),
}

/// Target of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FileTarget {
    /// Time after the first one, seconds.
    pub time_s: f64,
    /// Its line.
    pub line: TargetLine,
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

/// End of a sender, with the reason that it gets; `None` where it has ended by itself, or with
/// the stream.
struct End(Option<String>);

impl TargetStream {
    /// Listens for a program, or plays a file, and sends the targets to `sender`. A file begins
    /// when the run takes the first targets.
    ///
    /// # Errors
    /// Where the address cannot be used, or no thread can be started.
    pub fn start(source: TargetOrigin, sender: TargetSender) -> Result<Self, TargetStreamError> {
        let is_closed = Arc::new(AtomicBool::new(false));
        let (motion, zero) = (sender.begin(), Instant::now());
        let reader = Reader { sender, motion, is_closed: Arc::clone(&is_closed), zero };
        let thread = thread::Builder::new().name("targets".to_owned());
        let thread = match source {
            TargetOrigin::Program(address) => {
                let endpoint = Endpoint::listen(&address)?;
                thread.spawn(move || reader.receive(&endpoint))
            }
            TargetOrigin::File(targets) => thread.spawn(move || reader.play(&targets)),
        };
        let thread = Some(thread.map_err(TargetStreamError::Thread)?);
        Ok(Self { is_closed, thread })
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

impl Reader {
    fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }

    /// Sends the targets of a file, each at its time.
    fn play(self, targets: &[FileTarget]) {
        while !self.sender.is_taken() && !self.is_closed() {
            thread::sleep(Duration::from_millis(5));
        }
        let begin = Instant::now();
        for FileTarget { time_s, line } in targets {
            let due = begin + Duration::try_from_secs_f64(*time_s).unwrap_or(Duration::MAX / 4);
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
