//! `plumb-lab calibration`: the error of a camera's pose that each way of `plumb calibrate` finds
//! on random rigs, with the errors of a depth camera and of a person with a rule.

mod survey;
mod trial;

pub use survey::{Survey, survey};
pub use trial::{MAX_ATTEMPTS, Trial, TrialError, trial};

named! {
    /// Way of a calibration.
    CalibrationWay:
    Board "board" "a printed board";
    Motors "motors" "the pixels of the motors";
    Ball "ball" "six known places of the ball";
}
