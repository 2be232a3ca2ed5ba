//! The commands of the program: options, calls of the libraries, output.

/// Joins command lines to the examples below the help of a command.
macro_rules! examples {
    ($($line:literal),+ $(,)?) => { concat!("Examples:" $(, "\n  ", $line)+) };
}

pub(crate) mod board;
pub(crate) mod calibrate;
pub(crate) mod cameras;
pub(crate) mod check;
pub(crate) mod cosim;
pub(crate) mod demo;
pub(crate) mod emulate;
pub(crate) mod follow;
pub(crate) mod hold;
pub(crate) mod init;
pub(crate) mod manual;
pub(crate) mod motors;
pub(crate) mod plot;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod run;
