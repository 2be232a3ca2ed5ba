//! Outputs of the commands that run: progress on the terminal, run log and recording.

mod closed;
mod run_progress;

use std::io::{IsTerminal, stdout};
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode};
use std::thread;
use std::time::Duration;

use plumb_cameras::record::{Overflow, Recorder};
use plumb_config::error_chain::ErrorChain;
use plumb_log::{RunLog, RunPictures};
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::board_report::{NO_WARNINGS, driver_warnings, warning_advice};
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::observer::{
    EventKind, EventRecord, FrameRecord, FrameRecorder, Observer, RunEvent, Tone,
};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand};
use plumb_runtime::run::{RunError, Summary};

use super::interrupt::DefaultSignals;
use super::print::is_quiet;
use super::progress::tell_above;
use super::viewers::{self, Viewers};
use super::{FAILED, Failure, both, failed};
use closed::Closed;
use run_progress::Progress;

/// Rows that may wait for the disk: 5 minutes at 30 Hz, some 5 MB.
const LOG_CAPACITY: usize = 9000;

/// Longest wait at the end of a run for a terminal that nobody reads, or that is stopped (Ctrl-S).
const TERMINAL_TIMEOUT: Duration = Duration::from_secs(10);

/// Outputs of a run.
pub(super) struct Outputs {
    progress: Progress,
    log: BoundedObserver<RunLog>,
    folder: PathBuf,
    recorder: Option<FrameRecorder>,
    pictures: RunPictures,
    viewers: Viewers,
    /// Whether the run goes on after a fault, for its operator.
    is_operated: bool,
    /// The last fault that was printed, with its advice.
    told: Option<BoardFault>,
    /// The fault in which the board stands.
    standing: Option<BoardFault>,
    /// Command that clears a fault of the board.
    clear: String,
    /// The last warnings of drivers on a UART that were printed; [`NO_WARNINGS`] before the first.
    warnings: String,
}

/// Returns the text of an event for the terminal; `None` where the result of the run or the
/// progress line has it.
fn text(event: &RunEvent) -> Option<String> {
    if let Some(fault) = event.fault() {
        return Some(format!("the board has stopped by itself: {fault}. {}", fault.advice()));
    }
    match event.kind() {
        EventKind::Targets | EventKind::Stop | EventKind::Doubt => Some(event.to_string()),
        EventKind::Command if event.tone() == Tone::Bad => Some(event.to_string()),
        _ => None,
    }
}

impl Outputs {
    /// Starts the outputs of a run through so many targets; it goes on after a fault where
    /// `is_operated`. In virtual time nothing is late, and `overflow` is to block.
    pub(super) fn start(
        log: RunLog,
        recorder: Option<Recorder>,
        viewers: Viewers,
        overflow: Overflow,
        targets: Option<usize>,
        is_operated: bool,
    ) -> Result<Self, Failure> {
        let folder = log.path().to_owned();
        let settings =
            QueueSettings { name: "run log", capacity: LOG_CAPACITY, overflow, with_frames: false };
        let log = BoundedObserver::new(log, settings)?;
        let progress = run_progress::start(targets)?;
        let recorder = recorder.map(FrameRecorder::new);
        let pictures = RunPictures::default();
        Ok(Self {
            progress,
            log,
            folder,
            recorder,
            pictures,
            viewers,
            is_operated,
            told: None,
            standing: None,
            clear: "plumb clear".to_owned(),
            warnings: NO_WARNINGS.to_owned(),
        })
    }

    /// Names the command that clears a fault of the board.
    pub(super) fn cleared_by(self, clear: String) -> Self {
        Self { clear, ..self }
    }

    /// Returns the run folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Notes a fault, and that one was cleared.
    fn note_fault(&mut self, event: &RunEvent) {
        use OperatorCommand::ClearFault;

        match event {
            RunEvent::Command {
                command: ClearFault, outcome: CommandOutcome::Accepted, ..
            } => {
                self.standing = None;
            }
            event => self.standing = event.fault().or(self.standing),
        }
    }

    /// Prints the warnings of the drivers where they have changed.
    fn tell_warnings(&mut self, record: &FrameRecord) {
        let drivers = record.board.as_ref().and_then(|board| board.drivers);
        let Some(drivers) = drivers else { return };
        let warnings = driver_warnings(&drivers);
        if warnings == self.warnings {
            return;
        }
        let advice = warning_advice(&drivers).map(|advice| format!(" ({advice})"));
        let advice = advice.unwrap_or_default();
        tell_above(format_args!("warnings of the motor drivers: {warnings}{advice}"));
        self.warnings = warnings;
    }

    /// Writes what is left and closes the files. Returns the progress too: its terminal may be
    /// stopped (Ctrl-S), and the files do not wait for it.
    fn close(self) -> (Closed, Progress) {
        let dropped_rows = self.log.dropped();
        let (rows, unwritten) = match self.log.close() {
            Ok(log) => (Ok(()), log.unwritten().map(|error| ErrorChain(error).to_string())),
            Err(error) => (
                Err(failed(format!("the run folder is not complete: {}", ErrorChain(&error)))),
                None,
            ),
        };
        let pictures = self.pictures.write(&self.folder);
        let unwritten =
            unwritten.or_else(|| pictures.err().map(|error| ErrorChain(&error).to_string()));
        let recording = self.recorder.map(FrameRecorder::finish).transpose();
        let recording = recording.map_err(Failure::from);
        let viewers = viewers::close(self.viewers);
        let Self { folder, told, standing, clear, progress, .. } = self;
        let closed = Closed {
            folder,
            told,
            standing,
            clear,
            dropped_rows,
            unwritten,
            rows,
            recording,
            viewers,
        };
        (closed, progress)
    }

    /// Ends the command of a run: reports the result and hands the summary to `print`. The exit
    /// code is the run's; one that `is_endless` has done its work where a person has ended it and
    /// the motors stand. A row of the run log, a recording or a result that cannot be written
    /// fails the command too.
    pub(super) fn conclude(
        self,
        result: Result<Summary, RunError>,
        is_endless: bool,
        print: impl FnOnce(&Summary) -> Result<(), Failure>,
    ) -> Result<ExitCode, Failure> {
        let (summary, error) = match result {
            Ok(summary) => (summary, None),
            Err(RunError::Broken { error, summary }) => (*summary, Some(error)),
            Err(error) => return Err(error.into()),
        };
        let (closed, progress) = self.close();
        let _signals = DefaultSignals::begin();
        let is_done = is_endless && summary.ending.is_chosen() && summary.at_rest;
        let code = if summary.is_done || is_done { 0 } else { FAILED };
        let is_whole = error.is_none() && closed.is_whole();
        let end = || end_in_time(if is_whole { code } else { FAILED });
        // The result does not wait for a terminal that only messages go to.
        let (printed, ended) = if progress.is_some() && !stdout().is_terminal() {
            let printed = print(&summary);
            end();
            run_progress::close(progress);
            (printed, closed.report(&summary, error.as_ref()))
        } else {
            if progress.is_some() {
                end();
            }
            run_progress::close(progress);
            let ended = closed.report(&summary, error.as_ref());
            (print(&summary), ended)
        };
        both(ended, printed).map_err(Failure::with_result)?;
        Ok(ExitCode::from(code))
    }
}

/// Ends the program with `code` after [`TERMINAL_TIMEOUT`], unless it ends before.
fn end_in_time(code: u8) {
    let end = move || {
        thread::sleep(TERMINAL_TIMEOUT);
        process::exit(code.into());
    };
    // Without a thread the program waits.
    let _no_thread = thread::Builder::new().name("end".to_owned()).spawn(end);
}

impl Observer for Outputs {
    fn frame(&mut self, record: &FrameRecord) {
        self.log.frame(record);
        self.recorder.frame(record);
        self.pictures.frame(record);
        self.viewers.frame(record);
        self.progress.frame(record);
        self.tell_warnings(record);
    }

    fn event(&mut self, record: &EventRecord) {
        self.log.event(record);
        self.viewers.event(record);
        self.progress.event(record);
        self.note_fault(&record.event);
        if record.event.fault().is_some() && !self.is_operated {
            // It ends the run, and the result has it.
            return;
        }
        let Some(text) = text(&record.event) else { return };
        self.told = record.event.fault().or(self.told);
        if is_quiet() && record.event.tone() != Tone::Bad {
            return;
        }
        tell_above(format_args!("{text}"));
    }

    fn end(&mut self, summary: &Summary) {
        self.log.end(summary);
        self.viewers.end(summary);
    }

    fn failure(&mut self) -> Option<plumb_frame::source::BoxedError> {
        self.log.failure().or_else(|| self.viewers.failure())
    }

    fn dropped(&self) -> u64 {
        self.log.dropped() + self.recorder.dropped() + self.viewers.dropped()
    }
}
