//! What a person sees while a run goes on and when it is over.

use std::io::{IsTerminal, stderr};
use std::process::ExitCode;

use plumb::run::Row;
use plumb::session::Ended;

use super::FAILED;

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
                format!("ball at ({:6.3}, {:6.3}, {:6.3}) m, {:6.1} mm to go", p.x, p.y, p.z, e * 1e3)
            }
            _ => "no ball".to_owned(),
        };
        eprint!("\r\x1b[2Kframe {:5}  {:7.2} s  {place}  {}", row.frame, row.t_s, row.board);
    }

    /// Ends the line.
    pub(super) fn done(&self) {
        if self.on {
            eprintln!();
        }
    }
}

/// Tells people how a run ended and where it is kept; the exit code that goes with it.
pub(super) fn ended(run: &Ended) -> ExitCode {
    let Ended { summary, folder, unwritten } = run;
    let error = summary.error_mm.map(|e| format!(", filtered |e| = {e:.1} mm")).unwrap_or_default();
    eprintln!("{}: {} frames, {:.1} s{error}", summary.ending, summary.frames, summary.time_s);
    eprintln!("run folder: {}", folder.display());
    if let Some(error) = unwritten {
        eprintln!("plumb: the run folder is not complete: {error}");
    }
    if summary.reached { ExitCode::SUCCESS } else { ExitCode::from(FAILED) }
}
