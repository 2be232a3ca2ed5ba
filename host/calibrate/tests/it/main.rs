//! The tests of the calibration.

mod board;
mod lens;
mod points;
