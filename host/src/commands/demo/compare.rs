//! `plumb demo --compare`: the same task with every law, and their errors in one figure.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use plumb_log::{ComparisonLog, LawCurve, OutputDir};
use plumb_runtime::rig::{LawName, LawSettings, Rig};

use super::super::print::{self, tell};
use super::super::{FAILED, Failure, failed};
use super::{Args, drive};

/// Compares the laws, then prints the lines of JSON of the runs that ended, also after a failure.
pub(super) fn main(args: &Args, interrupted: &AtomicBool) -> Result<ExitCode, Failure> {
    let mut lines = Vec::new();
    let ended = compare(args, interrupted, &mut lines);
    lines.iter().try_for_each(print::result)?;
    ended
}

/// Runs every law, in the order of [`LawName::ALL`], into a folder of its own, and draws the
/// figure. Adds the line of JSON of each run to `lines`.
fn compare(
    args: &Args,
    interrupted: &AtomicBool,
    lines: &mut Vec<String>,
) -> Result<ExitCode, Failure> {
    let mut keep = |line: &str| {
        lines.push(line.to_owned());
        Ok(())
    };
    let folder = ComparisonLog::create(&args.options.output_dir("laws"))?;
    let threshold_m = Rig::paper()?.reached.radius.get();
    let (mut curves, mut code) = (Vec::new(), ExitCode::SUCCESS);
    for name in LawName::ALL {
        let settings = LawSettings::from(name);
        let mut curve = LawCurve::new(settings.title());
        let output_dir = OutputDir::Path(folder.path().join(name.as_str()));
        let ended = drive(args, settings, output_dir, interrupted, (&mut curve, &mut keep))?;
        if ended != ExitCode::SUCCESS {
            code = ExitCode::from(FAILED);
        }
        curves.push(curve);
        if interrupted.load(Ordering::Relaxed) {
            break;
        }
    }
    let figure = folder.finish(&curves, threshold_m).map_err(failed)?;
    tell!("the laws' errors over time: {}", figure.display());
    Ok(code)
}
