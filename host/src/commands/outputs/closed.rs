//! The result of a run, for people: how it ended, what its files lack, what to do next.

use std::path::PathBuf;

use plumb_cameras::camera_file::COMPARE_BALL;
use plumb_cameras::record::Recording;
use plumb_config::error_chain::ErrorChain;
use plumb_runtime::board_fault::BoardFault;
use plumb_runtime::link::LinkError;
use plumb_runtime::observer::RunEvent;
use plumb_runtime::run::{ControlLoopError, Summary};

use crate::commands::print::{is_quiet, note, tell};
use crate::commands::{Failure, both, failed};

/// What to do after the link to the board broke in mid-run.
const BOARD_LOST: &str = ". The board stops by itself: check plug and cable, then `plumb board \
                          status` says in which state it is. If it was an emulated one, start \
                          `plumb emulate` again";

/// Outputs whose files are closed.
pub(super) struct Closed {
    pub(super) folder: PathBuf,
    /// The last fault that was printed, with its advice.
    pub(super) told: Option<BoardFault>,
    /// The fault in which the board stands.
    pub(super) standing: Option<BoardFault>,
    /// Command that clears it.
    pub(super) clear: String,
    /// Number of rows that the run log lacks.
    pub(super) dropped_rows: u64,
    /// Message of the file of the run log, other than the rows, that could not be written.
    pub(super) unwritten: Option<String>,
    /// Failure to write the rows of the run log.
    pub(super) rows: Result<(), Failure>,
    /// Result of the recording, if there is one.
    pub(super) recording: Result<Option<Recording>, Failure>,
    /// Result of the outputs for viewers.
    pub(super) viewers: Result<(), Failure>,
}

impl Closed {
    /// Returns whether every file was written whole.
    pub(super) fn is_whole(&self) -> bool {
        let files = [self.rows.is_ok(), self.recording.is_ok(), self.viewers.is_ok()];
        self.unwritten.is_none() && files == [true; 3]
    }

    /// Reports the result of a run that ended, or failed with `error`. The last line says how it
    /// ended, and what to do next.
    ///
    /// # Errors
    /// The failure of the run, of the rows, of the recording or of the viewers. Those after the
    /// first are printed.
    pub(super) fn report(
        self,
        summary: &Summary,
        error: Option<&ControlLoopError>,
    ) -> Result<(), Failure> {
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
                let error = in_short(error);
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
        let error = summary.filtered_error_mm.map(|e| format!(", filtered |e| = {e:.1} mm"));
        let targets = match summary.legs.len() {
            0 | 1 => String::new(),
            // The way to the path counts as a target.
            _ if summary.path.is_some() => String::new(),
            _ if summary.targets_reached == 1 => ", 1 target reached".to_owned(),
            _ => format!(", {} targets reached", summary.targets_reached),
        };
        tell!(
            "{}: {frames} frame{}, {time:.1} s{targets}{}{}",
            summary.ending,
            if frames == 1 { "" } else { "s" },
            error.unwrap_or_default(),
            self.next_step(summary)
        );
    }

    /// Returns what to do after a run that did not do its work, behind the line that says how it
    /// ended.
    fn next_step(&self, summary: &Summary) -> String {
        let clear = format!(" `{}` clears it", self.clear);
        if let Some(fault) = self.standing.filter(|_| summary.ending.fault().is_none()) {
            return format!(". The board stands in a fault: {fault}. {}{clear}", fault.advice());
        }
        if summary.located == 0 && summary.frames > 0 {
            let clear = match summary.ending.fault() {
                Some(_) => format!(". The board stands in the fault:{clear}"),
                None => String::new(),
            };
            let doubt = summary.events.iter().find_map(|record| match record.event {
                RunEvent::Doubt(doubt) => Some(doubt),
                _ => None,
            });
            let why = match doubt {
                Some(doubt) => doubt.with_advice(),
                None => COMPARE_BALL.to_owned(),
            };
            return format!(
                ". The ball was never seen: {why}; `plumb replay RECORDING --debug DIR` shows each \
                 stage{clear}"
            );
        }
        let clear = if summary.ending.fault().is_some() { clear } else { String::new() };
        summary.ending.advice().map(|advice| format!(". {advice}{clear}")).unwrap_or_default()
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

/// Returns the error that broke a run and its causes in words. That of the link names the port: it
/// needs no words before it.
fn in_short(error: &ControlLoopError) -> String {
    match error {
        ControlLoopError::Link(error) => ErrorChain(error).to_string(),
        error => ErrorChain(error).to_string(),
    }
}

fn report_recording(recording: &Recording) {
    let dropped = match recording.dropped {
        0 => String::new(),
        n => format!(", {n} left out: they came faster than they could be written"),
    };
    note!("recorded: {} frames in {}{dropped}", recording.frames, recording.folder.display());
}
