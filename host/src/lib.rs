//! Plumb's host side: the link to the board, and runs. [`plumb_cameras`] gives the pictures and
//! [`plumb_vision`] finds the ball.
//!
//! ```text
//! camera -> RgbdFrame -> detect -> Detection -> locate -> Position (rig frame) -> link -> board
//! ```

pub mod bench;
pub mod cosim;
pub mod drive;
pub mod link;
mod palette;
pub mod replay;
pub mod rig;
pub mod run;
pub mod session;
pub mod source;
