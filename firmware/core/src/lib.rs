//! The board without hardware: control laws, step plans, the state machine and its stops.
//!
//! The crate is synchronous and has no clock, executor or HAL. The chip and the emulator give a
//! [`Board`] the frames that arrive and the time, call [`Board::tick`] every [`TICK_US`], and carry
//! out what it returns. The crate allocates nothing. The same input gives the same output, to the
//! bit: the arithmetic is fixed point, and in the law `taut` and the reference of a path f32 within
//! IEEE 754.
//!
//! ```text
//! frame -> Board::on_frame -> servo::Servo -> law -> Setpoint   (on every position)
//!                                          -> LawWorker         (a deferred law, ticks later)
//! time  -> Board::tick -> plan::Planner -> StepPlan             (every 200 µs)
//! ```
//!
//! A board answers a host's Hello and reports its state:
//!
//! ```
//! use plumb_core::law::LawTicks;
//! use plumb_core::{Board, BuildLimits, LawWorker, Outbox};
//! use plumb_protocol::boards::Chip;
//! use plumb_protocol::message::{Command, Hello, Request, State, ToBoard};
//! use plumb_protocol::units::Micros;
//!
//! let mut board = Board::new(BuildLimits {
//!     max_pulse_rate: 1_250_000,
//!     storage: false,
//!     chip: Some(Chip::Rp2040),
//!     law_ticks: LawTicks::RP2040,
//! });
//! let (mut law_worker, mut out) = (LawWorker::new(), Outbox::new());
//! let message = ToBoard { id: 1, command: Command::Hello(Hello::OURS) };
//! let hello = Request { message, crc: 0 };
//! board.on_frame(Micros(0), Ok(&hello), &mut out);
//! board.tick(Micros(0), &mut law_worker, &mut out);
//! assert!(!out.bytes().is_empty());
//! assert_eq!(board.state(), State::Unconfigured);
//! ```
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

pub mod board;
pub mod coils;
pub mod config_store;
pub mod law;
pub mod law_worker;
pub mod params;
pub mod plan;
pub mod segment;
pub mod servo;
pub mod soft_float;
pub mod timing;
pub mod tmc2209;
mod vector;
mod wide;

pub use board::{Board, Outbox, Tick};
pub use law::MotorRates;
pub use law_worker::LawWorker;
pub use params::BuildLimits;
pub use plan::{Pulses, StepPlan};
pub use timing::TICK_US;
