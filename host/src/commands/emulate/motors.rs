//! `plumb emulate --motors`: lines with the motor positions, for a simulator of the rig.

use std::fmt;
use std::io;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::thread;
use std::time::Duration;

use plumb_protocol::units::Micros;
use plumb_sim::emulator::MotorSample;

use crate::cli::exit::Failure;
use crate::cli::print::{self, Reader};

/// Interval of the lines on the board's clock.
pub(super) const INTERVAL: Micros = Micros(5000);

/// Number of lines that may wait for the reader: 2 s.
const CAPACITY: usize = 400;

/// Longest wait for the reader at the end.
const END_TIMEOUT: Duration = Duration::from_millis(500);

/// Line of motor positions.
struct Line(MotorSample);

impl fmt::Display for Line {
    /// Writes seconds of the board's time, and full steps since the start, + pays out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let MotorSample { time, motors: [a, b, c] } = self.0;
        let seconds = time.0 as f64 / 1e6;
        write!(f, r#"{{"t": {seconds:?}, "motors": [{a:?}, {b:?}, {c:?}]}}"#)
    }
}

/// Writer of the lines, in a thread of its own: a slow reader never delays the board.
pub(super) struct MotorLines {
    lines: SyncSender<Line>,
    /// Disconnected once the thread has ended.
    ended: Receiver<()>,
    dropped: u64,
}

impl MotorLines {
    /// Starts the thread.
    ///
    /// # Errors
    /// Where the operating system starts no thread.
    pub(super) fn start() -> io::Result<Self> {
        let (lines, waiting) = sync_channel(CAPACITY);
        let (alive, ended) = channel();
        thread::Builder::new().name("motors".to_owned()).spawn(move || {
            write(&waiting);
            drop(alive);
        })?;
        Ok(Self { lines, ended, dropped: 0 })
    }

    /// Adds samples, and the number of those that were dropped before. Samples without room are
    /// dropped.
    pub(super) fn add(&mut self, (samples, dropped): (Vec<MotorSample>, u64)) {
        self.dropped += dropped;
        for sample in samples {
            match self.lines.try_send(Line(sample)) {
                Err(TrySendError::Full(_)) => self.dropped += 1,
                // A reader that has gone needs no more lines.
                Ok(()) | Err(TrySendError::Disconnected(_)) => {}
            }
        }
    }

    /// Waits until the lines are written, and reports those that were dropped. Returns whether the
    /// reader has taken all lines.
    pub(super) fn end(self) -> bool {
        drop(self.lines);
        let is_written =
            self.ended.recv_timeout(END_TIMEOUT) != Err(std::sync::mpsc::RecvTimeoutError::Timeout);
        if self.dropped > 0 || !is_written {
            tell!("plumb: {} lines of motor positions dropped: their reader is slow", self.dropped);
        }
        is_written
    }
}

/// Writes lines to standard output until the last one, or until the reader has gone.
fn write(lines: &Receiver<Line>) {
    for line in lines {
        match print::results(line) {
            Ok(Reader::Open) => {}
            Ok(Reader::Closed) => return,
            Err(error) => return Failure::from(error).print(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_the_documented_format() {
        let sample = MotorSample { time: Micros(1_005_000), motors: [12.25, -3.0, 7.5] };
        assert_eq!(Line(sample).to_string(), r#"{"t": 1.005, "motors": [12.25, -3.0, 7.5]}"#);
    }
}
