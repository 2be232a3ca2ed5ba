//! Cameras and recordings through the real librealsense2 and its software device.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod fixture;
mod live;
mod recordings;
mod refusals;
