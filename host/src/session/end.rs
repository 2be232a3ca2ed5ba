//! The end of a run: its outputs are closed, and its result is printed.

use std::io::{IsTerminal, stdout};
use std::path::PathBuf;
use std::process;
use std::thread;
use std::time::Duration;

use plumb_page::Page;
use plumb_runtime::run::{RunError, Summary};

use crate::cli::exit::{Exit, Failure, both};
use crate::cli::interrupt::DefaultSignals;
use crate::session::outputs::{Output, Outputs, run_progress};
use crate::session::report::Report;

/// Longest wait at the end of a run for a terminal that nobody reads, or that is stopped (Ctrl-S).
const TERMINAL_TIMEOUT: Duration = Duration::from_secs(10);

/// A run that has ended, whose outputs are still open.
pub(crate) struct EndedSession {
    pub(crate) result: Result<Summary, RunError>,
    /// Whether the run goes on until somebody ends it.
    pub(crate) is_endless: bool,
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
        let report = Report { folder: self.folder.clone(), messages, clear: self.clear, closed };
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
