//! `plumb-lab calibration`: the error of a camera's pose that each way of `plumb calibrate` finds
//! on random rigs, with the errors of a depth camera and of a person with a rule.

mod survey;
mod trial;

use std::fmt;
use std::str::FromStr;

use crate::UnknownName;

pub use survey::{Survey, survey};
pub use trial::{MAX_ATTEMPTS, Trial, TrialError, trial};

/// Way of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CalibrationWay {
    /// A printed board.
    Board,
    /// The pixels of the motors.
    Motors,
    /// Six known places of the ball.
    Ball,
}

impl CalibrationWay {
    /// All ways.
    pub const ALL: [Self; 3] = [Self::Board, Self::Motors, Self::Ball];

    /// Returns the name in options, reports and JSON.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Motors => "motors",
            Self::Ball => "ball",
        }
    }
}

impl fmt::Display for CalibrationWay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for CalibrationWay {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let known = || UnknownName::new(Self::ALL);
        Self::ALL.into_iter().find(|way| way.as_str() == text).ok_or_else(known)
    }
}
