//! `plumb hold`: holds the ball where it is.

use clap::Parser;
use plumb_runtime::run::check_targets;

use crate::cli::exit::{Failure, Work};
use crate::cli::rig_path::RigArg;
use crate::commands::run::{Common, drive};
use crate::session::goal::Goal;

/// Hold the ball where it is, until Ctrl-C
///
/// The camera measures where the ball is. That place becomes the target, and the board corrects
/// every drift from it. At the end the motors stand and keep their current.
#[derive(Parser)]
#[command(after_help = examples!["plumb hold"])]
pub(crate) struct Args {
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    options: Common,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    args.options.run.check_hold()?;
    let (file, rig) = args.rig.read()?;
    if rig.plane.is_none() {
        check_targets(&rig)?;
    }
    args.options.port.note(&file, &rig);
    drive(&file, rig, Goal::PresentPlace, args.options)
}
