//! Choices by name on the command line: detector, physics, law.

use clap::ValueEnum;
use plumb_runtime::rig::{LawName, LawSettings, Rig, Simulation, UnknownLaw};
use plumb_sim::emulator::plant::{Elastic, ElasticParameters, Plant, QuasiStatic, RigError};
use plumb_sim::simulated::{geometry, wired};
use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectorKind};

/// Makes the detector for `camera` and its ball.
pub(crate) fn detector(kind: DetectorKind, camera: &Camera) -> Box<dyn BallDetector> {
    if kind == DetectorKind::Red {
        note!(
            "detector red: the paper's, for comparison. It needs depth, and takes other red \
             things for the ball; the default is `ball`"
        );
    }
    kind.build(camera)
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
    pub(crate) fn plant(
        self,
        rig: &Rig,
        simulation: &Simulation,
    ) -> Result<Box<dyn Plant + Send>, RigError> {
        let (geometry, start) = (geometry(simulation)?, simulation.start());
        let plant: Box<dyn Plant + Send> = match self {
            Self::QuasiStatic => Box::new(QuasiStatic::new(geometry, start)?),
            Self::Elastic => Box::new(Elastic::new(geometry, ElasticParameters::default(), start)?),
        };
        Ok(wired(rig, simulation, plant))
    }
}

/// Motor of the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "verbatim")]
pub(crate) enum MotorName {
    A,
    B,
    C,
}

/// Returns the law of this name with its default parameters.
pub(crate) fn law(name: &str) -> Result<LawSettings, UnknownLaw> {
    name.parse().map(LawName::into)
}
