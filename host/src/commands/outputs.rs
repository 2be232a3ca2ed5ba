//! Outputs of the commands that run: progress on the terminal, run log, recording, and the result
//! for people.

mod run_progress;

use std::io::{IsTerminal, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use plumb_cameras::camera_file::COMPARE_BALL;
use plumb_cameras::record::{Overflow, Recorder, Recording};
use plumb_config::error_chain::ErrorChain;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::board_report::{NO_WARNINGS, driver_warnings};
use plumb_runtime::bounded_observer::{BoundedObserver, QueueSettings};
use plumb_runtime::link::LinkError;
use plumb_runtime::observer::{
    EventKind, EventRecord, FrameRecord, FrameRecorder, Observer, RunEvent, Tone,
};
use plumb_runtime::operator::{CommandOutcome, OperatorCommand};
use plumb_runtime::run::{ControlLoopError, RunError, Summary};
use plumb_runtime::run_log::{RunLog, RunPictures};

use super::interrupt::DefaultSignals;
use super::print::{is_quiet, note, renew, tell};
use super::viewers::{self, Viewers};
use super::{FAILED, Failure, both, failed, failed_because};
use run_progress::Progress;

/// Rows that may wait for the disk: 5 minutes at 30 Hz, some 5 MB.
const LOG_CAPACITY: usize = 9000;

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
        EventKind::Targets | EventKind::Stop => Some(event.to_string()),
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
            warnings: NO_WARNINGS.to_owned(),
        })
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

    /// Prints a line in place of the progress line, which comes again with the next picture.
    fn tell(&self, text: &str) {
        if self.progress.is_some() {
            renew(format_args!("{text}\n"));
        } else {
            tell!("{text}");
        }
    }

    /// Prints the warnings of the drivers where they have changed.
    fn tell_warnings(&mut self, record: &FrameRecord) {
        let drivers = record.board.as_ref().and_then(|board| board.drivers);
        let Some(warnings) = drivers.map(|drivers| driver_warnings(&drivers)) else { return };
        if warnings == self.warnings {
            return;
        }
        self.tell(&format!("warnings of the motor drivers: {warnings}"));
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
        let recording = recording.map_err(failed_because);
        let viewers = viewers::close(self.viewers);
        let Self { folder, told, standing, .. } = self;
        let closed =
            Closed { folder, told, standing, dropped_rows, unwritten, rows, recording, viewers };
        (closed, self.progress)
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
        // The result does not wait for a terminal that only messages go to.
        let (printed, ended) = if progress.is_some() && !stdout().is_terminal() {
            let printed = print(&summary);
            run_progress::close(progress);
            (printed, closed.report(&summary, error.as_ref()))
        } else {
            run_progress::close(progress);
            let ended = closed.report(&summary, error.as_ref());
            (print(&summary), ended)
        };
        both(ended, printed).map_err(Failure::with_result)?;
        let is_done = is_endless && summary.ending.is_chosen() && summary.at_rest;
        Ok(if summary.reached || is_done { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
    }
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
        self.tell(&text);
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

/// What to do after the link to the board broke in mid-run.
const BOARD_LOST: &str = ". The board stops by itself: check plug and cable, then `plumb board \
                          status` says in which state it is";

/// Outputs whose files are closed.
struct Closed {
    folder: PathBuf,
    /// The last fault that was printed, with its advice.
    told: Option<BoardFault>,
    /// The fault in which the board stands.
    standing: Option<BoardFault>,
    /// Number of rows that the run log lacks.
    dropped_rows: u64,
    /// Message of the file of the run log, other than the rows, that could not be written.
    unwritten: Option<String>,
    /// Failure to write the rows of the run log.
    rows: Result<(), Failure>,
    /// Result of the recording, if there is one.
    recording: Result<Option<Recording>, Failure>,
    /// Result of the outputs for viewers.
    viewers: Result<(), Failure>,
}

impl Closed {
    /// Reports the result of a run that ended, or failed with `error`. The last line says how it
    /// ended, and what to do next.
    ///
    /// # Errors
    /// The failure of the run, of the rows, of the recording or of the viewers. Those after the
    /// first are printed.
    fn report(self, summary: &Summary, error: Option<&ControlLoopError>) -> Result<(), Failure> {
        let (frames, folder) = (summary.frames, self.folder.display());
        let is_told = summary.ending.fault().is_some_and(|fault| fault.is_of_the_computer());
        if let Some(late) = summary.late_wakeups.filter(|_| !is_told) {
            tell!("{late}");
        }
        let run = match error {
            Some(error) => {
                let untold = summary.ending.fault().filter(|fault| self.told != Some(*fault));
                if let Some(fault) = untold {
                    tell!("{}. {}", summary.ending, fault.advice());
                }
                let advice = match error {
                    ControlLoopError::Link(LinkError::Lost { .. }) => BOARD_LOST,
                    _ => "",
                };
                let error = ErrorChain(error);
                let so_far = format!("(recorded so far: {folder}, {frames} frames)");
                Err(failed(format!("{error} {so_far}{advice}")))
            }
            None if is_quiet() && summary.reached => Ok(()),
            None => {
                self.tell_result(summary);
                Ok(())
            }
        };
        let run = both(run, self.missing());
        let recording = self.recording.map(|recording| {
            if let Some(recording) = recording {
                report_recording(&recording);
            }
        });
        both(run, both(self.rows, both(recording, self.viewers)))
    }

    /// Prints the result of a run that ended.
    fn tell_result(&self, summary: &Summary) {
        tell!("run folder: {}", self.folder.display());
        if let Some(path) = &summary.path {
            tell!("{path}");
        }
        if let Some(targets) = &summary.targets {
            tell!("{targets}");
        }
        let (frames, time) = (summary.frames, summary.time_s);
        tell!("ball seen in {} of {frames} pictures", summary.located);
        let error = summary.error_mm.map(|e| format!(", filtered |e| = {e:.1} mm"));
        let targets = match summary.legs.len() {
            0 | 1 => String::new(),
            // The way to the path counts as a target.
            _ if summary.path.is_some() => String::new(),
            _ if summary.targets_reached == 1 => ", 1 target reached".to_owned(),
            _ => format!(", {} targets reached", summary.targets_reached),
        };
        tell!(
            "{}: {frames} frames, {time:.1} s{targets}{}{}",
            summary.ending,
            error.unwrap_or_default(),
            next_step(summary, self.standing)
        );
    }

    /// Reports what the run folder lacks.
    ///
    /// # Errors
    /// Where a file could not be written. Rows that a slow disk had no time for are no error.
    fn missing(&self) -> Result<(), Failure> {
        if self.dropped_rows > 0 {
            tell!("plumb: the run log lacks {} rows: the disk is slow", self.dropped_rows);
        }
        match &self.unwritten {
            Some(error) => Err(failed(format!("the run folder is not complete: {error}"))),
            None => Ok(()),
        }
    }
}

/// Returns what to do after a run that did not do its work, behind the line that says how it ended,
/// where the board is left in the fault `standing`.
fn next_step(summary: &Summary, standing: Option<BoardFault>) -> String {
    if let Some(fault) = standing.filter(|_| summary.ending.fault().is_none()) {
        return format!(". The board stands in a fault: {fault}. {}", fault.advice());
    }
    if summary.located == 0 && summary.frames > 0 {
        return format!(
            ". The ball was never seen: {COMPARE_BALL}; `plumb replay RECORDING --debug DIR` shows \
             each stage"
        );
    }
    summary.ending.advice().map(|advice| format!(". {advice}")).unwrap_or_default()
}

fn report_recording(recording: &Recording) {
    let dropped = match recording.dropped {
        0 => String::new(),
        n => format!(", {n} left out: they came faster than they could be written"),
    };
    note!("recorded: {} frames in {}{dropped}", recording.frames, recording.folder.display());
}
