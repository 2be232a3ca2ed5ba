//! Outputs of the commands that run: progress on the terminal, run log, recording, and the result
//! for people.

use std::io::{IsTerminal, stderr};
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_cameras::record::{Overflow, Recorder};
use plumb_runtime::observer::{FrameRecord, Observer, RunEvent};
use plumb_runtime::queued::{QueueSettings, Queued};
use plumb_runtime::recording::FrameRecorder;
use plumb_runtime::run::{RunError, Summary};
use plumb_runtime::run_log::RunLog;

use super::exit::Chain;
use super::print::{message, tell};
use super::{FAILED, Failure, both, failed};

/// Rows that may wait for the disk: 5 minutes at 30 Hz, some 5 MB.
const LOG_CAPACITY: usize = 9000;

/// Progress lines that may wait for the terminal.
const PROGRESS_CAPACITY: usize = 2;

/// Progress line on a terminal, renewed in place.
struct TerminalLine;

impl Observer for TerminalLine {
    fn frame(&mut self, record: &FrameRecord) {
        let ball = match (record.position(), record.error()) {
            (Some(p), Some(error)) => {
                let (x, y, z, error_mm) = (p.x, p.y, p.z, error * 1e3);
                format!("ball at ({x:6.3}, {y:6.3}, {z:6.3}) m, {error_mm:6.1} mm to go")
            }
            _ => "no ball".to_owned(),
        };
        let board = record.state.map(|state| state.to_string()).unwrap_or_default();
        let (number, time) = (record.number, record.time);
        message(format_args!("\r\x1b[2Kframe {number:5}  {time:7.2} s  {ball}  {board}"));
    }
}

/// Progress on standard error, where that is a terminal. Lines that the terminal has no time for
/// are left out.
struct Progress(Option<Queued<TerminalLine>>);

impl Progress {
    fn start() -> std::io::Result<Self> {
        let settings = QueueSettings {
            name: "progress",
            capacity: PROGRESS_CAPACITY,
            overflow: Overflow::Drop,
            with_frames: false,
        };
        let on = stderr().is_terminal();
        on.then(|| Queued::new(TerminalLine, settings)).transpose().map(Self)
    }

    /// Ends the line.
    fn close(self) {
        if let Some(queue) = self.0 {
            let _failed = queue.close();
            message(format_args!("\n"));
        }
    }
}

impl Observer for Progress {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(queue) = &mut self.0 {
            queue.frame(record);
        }
    }
}

/// Outputs of a run.
pub(super) struct Outputs {
    progress: Progress,
    log: Queued<RunLog>,
    folder: PathBuf,
    recorder: Option<FrameRecorder>,
}

impl Outputs {
    /// Starts the outputs. In virtual time nothing is late, and `overflow` is to block.
    pub(super) fn start(
        log: RunLog,
        recorder: Option<Recorder>,
        overflow: Overflow,
    ) -> Result<Self, Failure> {
        let folder = log.path().to_owned();
        let settings =
            QueueSettings { name: "run log", capacity: LOG_CAPACITY, overflow, with_frames: false };
        let log = Queued::new(log, settings)?;
        let progress = Progress::start()?;
        Ok(Self { progress, log, folder, recorder: recorder.map(FrameRecorder::new) })
    }

    /// Writes what is left, and reports the recording.
    fn close(self) -> Closed {
        self.progress.close();
        let dropped_rows = self.log.dropped();
        let (rows, unwritten) = match self.log.close() {
            Ok(log) => (Ok(()), log.unwritten().map(ToString::to_string)),
            Err(error) => {
                (Err(failed(format!("the run folder is not complete: {}", Chain(&error)))), None)
            }
        };
        let files = both(rows, report_recording(self.recorder));
        Closed { folder: self.folder, dropped_rows, unwritten, files }
    }

    /// Ends the command of a run: reports the result and hands the summary to `print`. The exit
    /// code is the run's. A row of the run log, a recording or a result that cannot be written
    /// fails the command too.
    pub(super) fn conclude(
        self,
        result: Result<Summary, RunError>,
        print: impl FnOnce(&Summary) -> Result<(), Failure>,
    ) -> Result<ExitCode, Failure> {
        let closed = self.close();
        match result {
            Ok(summary) => {
                let code = closed.report(&summary);
                both(closed.files, print(&summary)).map(|()| code)
            }
            Err(RunError::Broken { error, summary }) => {
                let printed = print(&summary);
                closed.report_missing();
                let (folder, frames) = (closed.folder.display(), summary.frames);
                let broken =
                    format!("{} (recorded so far: {folder}, {frames} frames)", Chain(&*error));
                both(Err(failed(broken)), both(closed.files, printed))
                    .map(|()| ExitCode::from(FAILED))
            }
            Err(error) => Err(error.into()),
        }
    }
}

impl Observer for Outputs {
    fn frame(&mut self, record: &FrameRecord) {
        self.log.frame(record);
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(record);
        }
        self.progress.frame(record);
    }

    fn event(&mut self, event: &RunEvent) {
        self.log.event(event);
    }

    fn end(&mut self, summary: &Summary) {
        self.log.end(summary);
    }

    fn failure(&mut self) -> Option<plumb_cameras::source::BoxedError> {
        self.log.failure()
    }

    fn dropped(&self) -> u64 {
        let frames = self.recorder.as_ref().map_or(0, Observer::dropped);
        self.log.dropped() + frames
    }
}

/// Outputs whose files are closed.
struct Closed {
    folder: PathBuf,
    /// Number of rows that the run log lacks.
    dropped_rows: u64,
    /// Message of the file of the run log, other than the rows, that could not be written.
    unwritten: Option<String>,
    /// Failure to write the rows of the run log or the recording.
    files: Result<(), Failure>,
}

impl Closed {
    /// Reports the result of a run and its folder. Returns the exit code.
    fn report(&self, summary: &Summary) -> ExitCode {
        let error = summary.error_mm.map(|e| format!(", filtered |e| = {e:.1} mm"));
        let (frames, time) = (summary.frames, summary.time_s);
        tell!("{}: {frames} frames, {time:.1} s{}", summary.ending, error.unwrap_or_default());
        tell!("run folder: {}", self.folder.display());
        self.report_missing();
        if summary.reached { ExitCode::SUCCESS } else { ExitCode::from(FAILED) }
    }

    /// Reports what the run folder lacks.
    fn report_missing(&self) {
        if self.dropped_rows > 0 {
            tell!("plumb: the run log lacks {} rows: the disk is slow", self.dropped_rows);
        }
        if let Some(error) = &self.unwritten {
            tell!("plumb: the run folder is not complete: {error}");
        }
    }
}

/// Ends a recording and reports it.
fn report_recording(recorder: Option<FrameRecorder>) -> Result<(), Failure> {
    let Some(recorder) = recorder else { return Ok(()) };
    let recording = recorder.finish().map_err(failed)?;
    let dropped = match recording.dropped {
        0 => String::new(),
        n => format!(", {n} left out: they came faster than they could be written"),
    };
    tell!("recorded: {} frames in {}{dropped}", recording.frames, recording.folder.display());
    Ok(())
}
