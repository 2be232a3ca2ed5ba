//! The tests of the page's server.

mod access;
mod calibration;
#[path = "../common/mod.rs"]
mod common;
mod hostile;
mod run;
