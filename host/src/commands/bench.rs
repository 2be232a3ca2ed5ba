//! `plumb bench`: benchmarks of control, vision, calibration and streams.

mod calibration;
mod control;
mod stream;
mod vision;

use std::process::ExitCode;

use clap::Subcommand;

use super::Failure;
use calibration::CalibrationArgs;
use control::ControlArgs;
use stream::StreamArgs;
use vision::VisionArgs;

#[derive(Subcommand)]
pub(crate) enum Command {
    Control(ControlArgs),
    Vision(VisionArgs),
    Calibration(CalibrationArgs),
    Stream(StreamArgs),
}

pub(crate) fn main(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Control(args) => control::main(&args),
        Command::Vision(args) => vision::main(&args),
        Command::Calibration(args) => calibration::main(&args),
        Command::Stream(args) => stream::main(&args),
    }
}
