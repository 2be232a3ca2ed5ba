//! Tests of `plumb-openni` with the real libOpenNI2 and the camera of this crate.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod fixture;
mod live;
mod recordings;
mod threads;
