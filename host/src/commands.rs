//! The commands of the program: options, calls of the libraries, output.

/// Joins command lines to the examples below the help of a command.
macro_rules! examples {
    ($($line:literal),+ $(,)?) => { concat!("Examples:" $(, "\n  ", $line)+) };
}

mod address;
pub(crate) mod board;
pub(crate) mod calibrate;
pub(crate) mod cameras;
pub(crate) mod check;
mod connection;
pub(crate) mod cosim;
pub(crate) mod demo;
pub(crate) mod emulate;
mod exit;
mod find_ball;
pub(crate) mod follow;
mod goal;
mod hints;
pub(crate) mod hold;
mod home_folder;
pub(crate) mod init;
mod interrupt;
pub(crate) mod manual;
pub(crate) mod motors;
mod number_list;
mod numbers;
mod old_file;
mod operators;
mod options;
mod outputs;
mod page;
pub(crate) mod plot;
pub(crate) mod print;
mod progress;
mod real_time;
pub(crate) mod replay;
pub(crate) mod report;
mod rig_args;
mod rig_path;
mod ros2;
pub(crate) mod run;
mod run_camera;
mod session;
pub(crate) mod verbose;
mod viewers;

use std::ffi::OsString;

use clap::ValueEnum;
use plumb_runtime::rig::{LawName, LawSettings, Rig, Simulation, UnknownLaw};
use plumb_sim::emulator::plant::{Elastic, ElasticParameters, Plant, QuasiStatic, RigError};
use plumb_sim::simulated::{geometry, wired};
use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectorKind};

use exit::{bad_input, failed};
use print::note;

pub(crate) use exit::{BAD_INPUT, FAILED, Failure, Work, report_usage};
pub(crate) use interrupt::outlive_file_size_limit;

/// Name of a detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DetectorName {
    /// Depth and a network propose; edges, depth and two networks decide
    Ball,
    /// The paper's: difference of Gaussians on the red channel
    Red,
}

impl DetectorName {
    /// Makes the detector for `camera` and its ball.
    fn detector(self, camera: &Camera) -> Box<dyn BallDetector> {
        let kind = match self {
            Self::Ball => DetectorKind::Ball,
            Self::Red => {
                note!(
                    "detector red: the paper's, for comparison. It needs depth, and takes other \
                     red things for the ball; the default is `ball`"
                );
                DetectorKind::Red
            }
        };
        kind.build(camera)
    }
}

/// Physics of the simulated rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Physics {
    /// Rigid cables, the ball always at rest
    QuasiStatic,
    /// A ball of 0.2 kg on cables of 800 N/m
    Elastic,
}

impl Physics {
    /// Creates the simulated rig of `rig`, wired to the board as its file says.
    fn plant(self, rig: &Rig, simulation: &Simulation) -> Result<Box<dyn Plant + Send>, RigError> {
        let (geometry, start) = (geometry(simulation)?, simulation.start());
        let plant: Box<dyn Plant + Send> = match self {
            Self::QuasiStatic => Box::new(QuasiStatic::new(geometry, start)?),
            Self::Elastic => Box::new(Elastic::new(geometry, ElasticParameters::default(), start)?),
        };
        Ok(wired(rig, simulation, plant))
    }
}

/// Returns the words of the command line as the parser takes them.
pub(crate) fn command_line() -> Vec<OsString> {
    std::env::args_os().map(home_folder::expanded).collect()
}

/// Returns the law of this name with its default parameters.
fn law(name: &str) -> Result<LawSettings, UnknownLaw> {
    name.parse().map(LawName::into)
}

/// Returns the first of two failures, and prints the second.
fn both(first: Result<(), Failure>, second: Result<(), Failure>) -> Result<(), Failure> {
    match (first, second) {
        (Err(first), Err(second)) => {
            second.print();
            Err(first)
        }
        (first, second) => first.and(second),
    }
}
