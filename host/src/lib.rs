//! Plumb's host side: cameras, detection, geometry, the link to the board, and runs.
//!
//! ```text
//! camera -> RgbdFrame -> detect -> Detection -> locate -> Position (rig frame) -> link -> board
//! ```

pub mod bench;
pub mod bounded_read;
pub mod camera;
pub mod cosim;
pub mod detect;
pub mod drive;
pub mod frame;
pub mod link;
pub mod locate;
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
