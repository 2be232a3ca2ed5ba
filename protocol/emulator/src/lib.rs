//! A board and a rig that are not there: the board's own code ([`plumb_core`]) on a host, in
//! virtual time or on a pseudo-terminal, and three cables with a ball that its steps move.

pub mod board;
pub mod rig;
pub mod serve;
pub mod terminal;
pub mod wire;

pub use board::{EMULATED, EmulatedBoard};
pub use serve::{Served, serve};
pub use terminal::Terminal;
pub use wire::Wire;
