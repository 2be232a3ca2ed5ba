//! Everything the board thinks, with no hardware in it: the laws, the step plans, the state machine
//! and its stops.
//!
//! The crate is synchronous and knows no clock, executor or HAL. The chip and the emulator give a
//! [`Board`] the bytes that arrive and the time, call [`Board::tick`] every [`TICK_US`], and carry
//! out what it returns. It allocates nothing, and does the same for the same input, to the bit:
//! fixed point, but for one law in f32 that keeps to what IEEE 754 lays down.
//!
//! ```text
//! bytes -> Board::receive -> law -> MotorRates        (on every position; a slow law in a LawWorker, some ticks later)
//! time  -> Board::tick -> Planner -> StepPlan         (every 200 µs)
//! ```
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod board;
pub mod clock;
pub mod coils;
pub mod config_store;
pub mod driver_timing;
pub mod law;
pub mod law_worker;
pub mod params;
pub mod plan;
pub mod segment;
pub mod servo;
pub mod soft_float;
mod wide;

pub use board::{Board, Outbox, Tick};
pub use clock::TICK_US;
pub use law::MotorRates;
pub use law_worker::LawWorker;
pub use params::BuildLimits;
pub use plan::{Pulses, StepPlan};
