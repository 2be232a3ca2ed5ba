//! `plumb demo`: the paper's task, closed loop, without any hardware; with `--compare` with every
//! law, and their errors in one figure.

mod planar;
mod task;

use std::sync::atomic::Ordering;

use plumb_log::{ComparisonLog, LawCurve, OutputDir};
use plumb_runtime::rig::{LawName, LawSettings, Rig};

use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::interrupt::interrupt_flag;
use crate::cli::print;
use task::{Demo, chosen};

pub(crate) use task::Args;

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    if args.compare {
        return prepare_comparison(args);
    }
    if args.planar {
        return Ok(Box::new(move || planar::run(&args, &*interrupt_flag(true)?)));
    }
    let law = chosen(&args)?;
    let mut curve = LawCurve::new(law.title());
    let demo = Demo::prepare(&args, law, args.options.output_dir("demo"))?;
    Ok(Box::new(move || {
        let interrupted = interrupt_flag(true)?;
        demo.drive(&args, &interrupted, (&mut curve, &mut |line| Ok(print::result(line)?)))
    }))
}

/// Prepares the comparison of the laws. Its work prints the lines of JSON of the runs that ended,
/// also after a failure.
fn prepare_comparison(args: Args) -> Result<Work, Failure> {
    let folder = ComparisonLog::create(&args.options.output_dir("laws"))?;
    Ok(Box::new(move || {
        let mut lines = Vec::new();
        let ended = compare(&args, folder, &mut lines);
        lines.iter().try_for_each(print::result)?;
        ended
    }))
}

/// Runs every law, in the order of [`LawName::ALL`], into a folder of its own, and draws the
/// figure. Adds the line of JSON of each run to `lines`.
fn compare(args: &Args, folder: ComparisonLog, lines: &mut Vec<String>) -> Result<Exit, Failure> {
    let interrupted = interrupt_flag(true)?;
    let mut keep = |line: &str| {
        lines.push(line.to_owned());
        Ok(())
    };
    let threshold_m = Rig::paper()?.reached.radius.get();
    let (mut curves, mut code) = (Vec::new(), Exit::Done);
    for name in LawName::ALL {
        let settings = LawSettings::from(name);
        let mut curve = LawCurve::new(settings.title());
        let output_dir = OutputDir::Path(folder.path().join(name.as_str()));
        let demo = Demo::prepare(args, settings, output_dir)?;
        let ended = demo.drive(args, &interrupted, (&mut curve, &mut keep))?;
        if ended != Exit::Done {
            code = Exit::Failed;
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
