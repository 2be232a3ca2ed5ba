//! The end of a run: its outputs are closed, and its result is printed for people: how it ended,
//! what its files lack, what to do next.

use std::io::{IsTerminal, stdout};
use std::path::{Path, PathBuf};
use std::process;
use std::thread;
use std::time::Duration;

use plumb_cameras::camera_file::COMPARE_BALL;
use plumb_config::error_chain::ErrorChain;
use plumb_page::Page;
use plumb_runtime::link::{LinkError, is_pseudo_terminal};
use plumb_runtime::observer::RunEvent;
use plumb_runtime::run::{ControlLoopError, RunError, Summary};

use crate::cli::exit::{Exit, Failure, both, failed};
use crate::cli::interrupt::DefaultSignals;
use crate::cli::print::is_quiet;
use crate::session::outputs::{Closed, Messages, Output, Outputs, run_progress};

/// Longest wait at the end of a run for a terminal that nobody reads, or that is stopped (Ctrl-S).
const TERMINAL_TIMEOUT: Duration = Duration::from_secs(10);

/// A run that has ended, whose outputs are still open.
pub(crate) struct EndedSession {
    pub(crate) result: Result<Summary, RunError>,
    /// Whether the run goes on until somebody ends it.
    pub(crate) is_endless: bool,
    /// Seconds of a simulation in a second of the computer.
    pub(crate) pace: Option<f64>,
    pub(crate) outputs: Outputs,
    /// The run folder.
    pub(crate) folder: PathBuf,
    /// Command that clears a fault of the board.
    pub(crate) clear: String,
    /// The page, which may outlive the run to offer its files.
    pub(crate) page: Option<Page>,
}

impl EndedSession {
    /// Closes the outputs, reports the result, and hands the summary to `print`. The exit code is
    /// the run's; an endless one has done its work where a person has ended it and the motors
    /// stand. An output or a result that cannot be written fails the command too.
    pub(crate) fn conclude(
        self,
        print: impl FnOnce(&Summary) -> Result<(), Failure>,
    ) -> Result<Exit, Failure> {
        let (summary, error) = match self.result {
            Ok(summary) => (summary, None),
            Err(RunError::Broken { error, summary }) => (*summary, Some(error)),
            Err(error) => return Err(error.into()),
        };
        let Outputs { list, progress, messages } = self.outputs;
        // The terminal may be stopped (Ctrl-S), and the files do not wait for it.
        let closed: Vec<_> = list.into_iter().map(Output::close).collect();
        let _signals = DefaultSignals::begin();
        let is_done = self.is_endless && summary.ending.is_chosen() && summary.at_rest;
        let exit = Exit::done_if(summary.is_done || is_done);
        let is_whole = error.is_none() && closed.iter().all(|closed| closed.result.is_ok());
        let end = || end_in_time(if is_whole { exit } else { Exit::Failed });
        let (folder, clear, pace) = (self.folder.clone(), self.clear, self.pace);
        let report = Report { folder, messages, clear, pace, closed };
        let print = |summary: &Summary| {
            print(summary)?;
            if let Some(page) = self.page {
                page.finish(&self.folder);
            }
            Ok(())
        };
        // The result does not wait for a terminal that only messages go to.
        let (printed, ended) = if progress.is_some() && !stdout().is_terminal() {
            let printed = print(&summary);
            end();
            run_progress::close(progress);
            (printed, report.tell(&summary, error.as_ref()))
        } else {
            if progress.is_some() {
                end();
            }
            run_progress::close(progress);
            let ended = report.tell(&summary, error.as_ref());
            (print(&summary), ended)
        };
        both(ended, printed).map_err(Failure::with_result)?;
        Ok(exit)
    }
}

/// Ends the program with `exit` after [`TERMINAL_TIMEOUT`], unless it ends before.
fn end_in_time(exit: Exit) {
    let end = move || {
        thread::sleep(TERMINAL_TIMEOUT);
        process::exit(exit as i32);
    };
    // Without a thread the program waits.
    let _no_thread = thread::Builder::new().name("end".to_owned()).spawn(end);
}

/// Pace below which a person is told that a simulation was slow.
const SLOW_PACE: f64 = 0.9;

/// What to do after the link to the board broke in mid-run.
const BOARD_LOST: &str = ". The board stops by itself: check plug and cable, then `plumb board \
                          status` says in which state it is";

/// The same for an emulated board.
const EMULATION_LOST: &str = ". Start `plumb emulate` again";

/// A run whose outputs are closed.
pub(crate) struct Report {
    pub(crate) folder: PathBuf,
    pub(crate) messages: Messages,
    /// Command that clears a fault of the board.
    pub(crate) clear: String,
    /// Seconds of a simulation in a second of the computer.
    pub(crate) pace: Option<f64>,
    pub(crate) closed: Vec<Closed>,
}

impl Report {
    /// Reports the result of a run that ended, or failed with `error`. The last line says how it
    /// ended, and what to do next.
    ///
    /// # Errors
    /// The failure of the run, or of an output. Those after the first are printed.
    pub(crate) fn tell(
        self,
        summary: &Summary,
        error: Option<&ControlLoopError>,
    ) -> Result<(), Failure> {
        let is_told = summary.ending.fault().is_some_and(|fault| fault.is_of_the_computer());
        if let Some(late) = summary.late_wakeups.filter(|_| !is_told) {
            tell!("{late}");
        }
        if let Some(pace) = self.pace.filter(|pace| *pace < SLOW_PACE) {
            tell!("the simulation ran at {pace:.1} of real time: the computer was busy");
        }
        let run = match error {
            Some(error) => Err(self.broken(summary, error)),
            None => {
                if !(is_quiet() && summary.reached) {
                    self.tell_result(summary);
                }
                Ok(())
            }
        };
        self.closed.into_iter().fold(run, |before, Closed { message, result }| {
            if let Some(message) = message {
                tell!("{message}");
            }
            both(before, result)
        })
    }

    /// Returns the failure of a run that `error` broke.
    fn broken(&self, summary: &Summary, error: &ControlLoopError) -> Failure {
        let fault = summary.ending.fault().filter(|fault| self.messages.told != Some(*fault));
        if let Some(fault) = fault {
            tell!("{}. {}", summary.ending, fault.advice());
        }
        // The error of the link names the port: it needs no words before it.
        let (error, advice) = match error {
            ControlLoopError::Link(error @ LinkError::Lost { port, .. }) => {
                let is_emulated = is_pseudo_terminal(Path::new(port));
                let advice = if is_emulated { EMULATION_LOST } else { BOARD_LOST };
                (ErrorChain(error).to_string(), advice)
            }
            ControlLoopError::Link(error) => (ErrorChain(error).to_string(), ""),
            error => (ErrorChain(error).to_string(), ""),
        };
        let (folder, frames) = (self.folder.display(), summary.frames);
        failed(format!("{error} (recorded so far: {folder}, {frames} frames){advice}"))
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
        if let Some(fault) = self.messages.standing.filter(|_| summary.ending.fault().is_none()) {
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
}
