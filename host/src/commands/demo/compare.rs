//! `plumb demo --compare`: the same task with every law, and their errors in one figure.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::{LawCurve, LawsFolder};
use plumb_runtime::session::Place;

use super::super::print::tell;
use super::super::{FAILED, Failure, OrFail, law};
use super::{Args, drive};

/// Runs every law, in the order of [`LawSettings::NAMES`], into a folder of its own.
pub(super) fn main(args: &Args, interrupted: &AtomicBool) -> Result<ExitCode, Failure> {
    let folder = match args.options.place("laws") {
        Place::Folder(path) => LawsFolder::create(path),
        Place::Numbered(prefix) => LawsFolder::create_numbered("runs", prefix),
    }
    .or_bad_input()?;
    let threshold_m = Rig::paper().or_bad_input()?.reached.radius.get();
    let (mut curves, mut code) = (Vec::new(), ExitCode::SUCCESS);
    for name in LawSettings::NAMES {
        let settings = law(name).or_bad_input()?;
        let mut curve = LawCurve { law: settings.title(), points: Vec::new() };
        let place = Place::Folder(folder.path().join(name));
        let ended = drive(args, settings, place, interrupted, &mut |row| {
            curve.points.extend(row.error_m.map(|error_m| (row.t_s, error_m)));
        })?;
        if ended != ExitCode::SUCCESS {
            code = ExitCode::from(FAILED);
        }
        curves.push(curve);
        if interrupted.load(Ordering::Relaxed) {
            break;
        }
    }
    let figure = folder.finish(&curves, threshold_m).or_failed()?;
    tell!("the laws' errors over time: {}", figure.display());
    Ok(code)
}
