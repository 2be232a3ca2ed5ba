//! `plumb demo --compare`: the same task with every law, and their errors in one figure.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_runtime::run_log::{ComparisonLog, LawCurve, OutputDir};

use super::super::print::tell;
use super::super::{FAILED, Failure, failed};
use super::{Args, drive};

/// Runs every law, in the order of [`LawName::ALL`], into a folder of its own.
pub(super) fn main(args: &Args, interrupted: &AtomicBool) -> Result<ExitCode, Failure> {
    let folder = ComparisonLog::create(&args.options.output_dir("laws"))?;
    let threshold_m = Rig::paper()?.reached.radius.get();
    let (mut curves, mut code) = (Vec::new(), ExitCode::SUCCESS);
    for name in LawName::ALL {
        let settings = LawSettings::from(name);
        let mut curve = LawCurve::new(settings.title());
        let output_dir = OutputDir::Path(folder.path().join(name.as_str()));
        let ended = drive(args, settings, output_dir, interrupted, &mut curve)?;
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
