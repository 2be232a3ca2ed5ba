//! The program with a camera, through the real libOpenNI2 and the test driver of
//! `tests/openni-driver`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod damaged;
mod devices;
mod fixture;
mod runs;
