//! `plumb bench`: benchmarks of control, vision, calibration and streams.

mod calibration;
mod control;
mod stream;
mod vision;

use std::process::ExitCode;

use clap::Subcommand;
use plumb_bench::control::{BenchError, ControlError};
use plumb_bench::vision::VisionError;

use super::Failure;
use crate::commands::exit::{BAD_INPUT, ExitClass, FAILED, exit_code_of};
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

/// Begins a benchmark: that of rigs does its first one, the others are prepared.
#[cfg(test)]
pub(crate) fn begin(command: Command) -> Result<(), Failure> {
    match command {
        Command::Control(args) => control::main(&args.first_rig_alone()).map(drop),
        Command::Vision(args) => vision::prepare(&args).map(drop),
        Command::Calibration(args) => calibration::main(&args.first_rig_alone()).map(drop),
        Command::Stream(args) => {
            let _options = stream::options(&args);
            Ok(())
        }
    }
}

pub(crate) fn main(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Control(args) => control::main(&args),
        Command::Vision(args) => vision::main(&args),
        Command::Calibration(args) => calibration::main(&args),
        Command::Stream(args) => stream::main(&args),
    }
}

exit_code_of! { FAILED: ControlError, VisionError }

impl ExitClass for BenchError {
    fn exit_code(&self) -> u8 {
        if matches!(self, Self::Range(_) | Self::Config(_)) { BAD_INPUT } else { FAILED }
    }
}
