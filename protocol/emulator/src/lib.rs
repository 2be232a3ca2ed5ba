//! An emulated board and a simulated rig: the board's own code ([`plumb_core`]) on a host, in
//! virtual time or on a pseudo-terminal, and a ball on three cables that its steps move.

pub mod board;
pub mod rig;
pub mod serve;
pub mod terminal;
pub mod wire;

pub use board::{EMULATED, EmulatedBoard};
pub use serve::{Served, serve};
pub use terminal::Terminal;
pub use wire::Wire;
