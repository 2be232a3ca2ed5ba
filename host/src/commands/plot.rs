//! `plumb plot`: the figures of runs, drawn again from their folders.

use std::path::PathBuf;

use clap::Parser;
use plumb_log::{LoggedRun, compare};

use crate::cli::exit::{Exit, Failure, Work, failed};

/// Draw the figures of runs again; of several runs also their errors over time in one figure
///
/// Each folder is one that demo, run or goto wrote. figure4.svg and figure5.svg in it are replaced,
/// and deviation.svg where the run followed a path.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb plot runs/demo-0001",
    "plumb plot runs/run-0001 runs/run-0002 --out compared.svg",
])]
pub(crate) struct Args {
    /// The folders of the runs
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// File for the errors of several runs over time, new [default: runs.svg]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    if args.runs.len() == 1 && args.out.is_some() {
        return Err(failed(
            "--out is for the errors of several runs: the figures of one run are written into its \
             folder",
        ));
    }
    let out = args.out.unwrap_or_else(|| "runs.svg".into());
    if out.extension().is_some_and(|ending| !ending.eq_ignore_ascii_case("svg")) {
        return Err(failed(format!("{}: must end in .svg: the figure is an SVG", out.display())));
    }
    if args.runs.len() > 1 && out.symlink_metadata().is_ok() {
        return Err(failed(format!(
            "{}: exists already, and is not overwritten: give another file with --out, or remove \
             it",
            out.display()
        )));
    }
    // Every folder is read before a figure is replaced.
    let runs = args.runs.iter().map(|run| LoggedRun::read(run)).collect::<Result<Vec<_>, _>>()?;
    Ok(Box::new(move || {
        for run in &runs {
            for figure in run.redraw()? {
                note!("{}", figure.display());
            }
        }
        if runs.len() > 1 {
            compare(&runs, &out)?;
            note!("{}", out.display());
        }
        Ok(Exit::Done)
    }))
}
