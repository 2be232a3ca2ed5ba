//! Plumb's host side: cameras, the link to the board, and runs. [`plumb_vision`] finds the ball.
//!
//! ```text
//! camera -> RgbdFrame -> detect -> Detection -> locate -> Position (rig frame) -> link -> board
//! ```

pub mod bench;
pub mod bounded_read;
pub mod camera_file;
pub mod cosim;
pub mod drive;
pub mod link;
mod palette;
pub mod record;
pub mod replay;
pub mod rig;
pub mod run;
pub mod session;
pub mod source;
pub mod survey;
pub mod toml_file;

/// The example in docs/cameras.md is compiled and run with the other tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/cameras.md")]
struct CamerasPage;
