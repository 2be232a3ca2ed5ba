//! What a person sees while a run goes on and when it is over.

use std::io::{IsTerminal, stderr};
use std::process::ExitCode;

use plumb_protocol::message::Refusal;
use plumb_runtime::link::LinkError;
use plumb_runtime::run::Row;
use plumb_runtime::session::{Ended, SessionError, Summary};

use super::print::{message, tell};
use super::{FAILED, Failure, OrFail, both};

/// A progress line on a terminal, renewed in place; nothing elsewhere.
pub(super) struct Progress {
    on: bool,
}

impl Progress {
    pub(super) fn new() -> Self {
        Self { on: stderr().is_terminal() }
    }

    pub(super) fn show(&self, row: &Row) {
        if !self.on {
            return;
        }
        let place = match (row.position, row.error_m) {
            (Some(p), Some(e)) => {
                format!(
                    "ball at ({:6.3}, {:6.3}, {:6.3}) m, {:6.1} mm to go",
                    p.x,
                    p.y,
                    p.z,
                    e * 1e3
                )
            }
            _ => "no ball".to_owned(),
        };
        let (frame, time, board) = (row.frame, row.t_s, &row.board);
        message(format_args!("\r\x1b[2Kframe {frame:5}  {time:7.2} s  {place}  {board}"));
    }

    /// Ends the line.
    pub(super) fn done(&self) {
        if self.on {
            message(format_args!("\n"));
        }
    }
}

/// Tells people how a run ended and where it is kept; the exit code that goes with it.
fn ended(run: &Ended) -> ExitCode {
    let Ended { summary, folder, .. } = run;
    let error = summary.error_mm.map(|e| format!(", filtered |e| = {e:.1} mm")).unwrap_or_default();
    tell!("{}: {} frames, {:.1} s{error}", summary.ending, summary.frames, summary.time_s);
    tell!("run folder: {}", folder.display());
    tell_unwritten(run);
    if summary.reached { ExitCode::SUCCESS } else { ExitCode::from(FAILED) }
}

/// Tells people what of a run's folder could not be written.
fn tell_unwritten(run: &Ended) {
    if let Some(error) = &run.unwritten {
        tell!("plumb: the run folder is not complete: {error}");
    }
}

/// Ends the command of a run: tells people how it went and hands `print` its summary. The exit code
/// is the run's: what could not be written besides is told, and fails the command only where it was
/// asked for.
pub(super) fn conclude(
    result: Result<Ended, SessionError>,
    recording: Result<(), Failure>,
    print: impl FnOnce(&Summary) -> Result<(), Failure>,
) -> Result<ExitCode, Failure> {
    match result {
        Ok(run) => {
            let code = ended(&run);
            both(recording, print(&run.summary)).map(|()| code)
        }
        Err(SessionError::Broken { error, ended }) => {
            let printed = print(&ended.summary);
            tell_unwritten(&ended);
            let broken = Err(SessionError::Broken { error, ended }).or_failed();
            both(broken, both(recording, printed)).map(|()| ExitCode::from(FAILED))
        }
        // A board that refuses the configuration finds a mistake in the rig file; what else goes
        // wrong with it is no mistake of input.
        Err(SessionError::Link(error))
            if !matches!(error, LinkError::Refused { refusal: Refusal::Config(_), .. }) =>
        {
            Err(error).or_failed()
        }
        Err(error) => Err(error).or_bad_input(),
    }
}
