//! Messages between a Plumb host and its board, units on the wire, and framing.
//!
//! A message ([`ToBoard`] or [`FromBoard`]) is serialised with postcard, followed by its CRC-32,
//! and wrapped in a COBS frame that ends with a zero byte ([`frame`]). Frames pass over any stream
//! of bytes: USB-CDC, a UART, a pseudo-terminal, memory. The crate contains no control law.
//!
//! A host encodes a command. The other side finds it in the stream, in pieces of any size:
//!
//! ```
//! use plumb_protocol::frame::{Accumulator, encode};
//! use plumb_protocol::{Command, Hello, ToBoard};
//!
//! let hello = ToBoard { id: 1, command: Command::Hello(Hello::OURS) };
//! let frame = encode(&hello)?;
//! let mut accumulator = Accumulator::new();
//! let mut received = frame.iter().filter_map(|&byte| accumulator.push::<ToBoard>(byte));
//! assert_eq!(received.next(), Some(Ok(hello)));
//! # Ok::<(), plumb_protocol::frame::TooLong>(())
//! ```
//!
//! # Order, loss and duplicates
//! Frames may be lost, damaged, delayed or doubled. A byte stream keeps the order of the frames
//! that arrive. A damaged frame is dropped and counted. The guarantees of each message:
//!
//! - [`Position`](message::Command::Position): carries a sequence number. The board accepts only
//!   numbers newer than the last accepted one: a doubled or late position has no effect. A
//!   lost position is not sent again: the next one replaces it.
//! - [`Follow`](message::Command::Follow): carries a sequence number as positions do, and replaces
//!   the reference before it. An accepted one is answered, and telemetry names the newest.
//! - [`Hello`](message::Command::Hello), [`Stop`](message::Command::Stop),
//!   [`Bootloader`](message::Command::Bootloader), [`Status`](message::Command::Status),
//!   [`Diagnose`](message::Command::Diagnose), [`Measure`](message::Command::Measure),
//!   [`Wire`](message::Command::Wire): safe to repeat, since the board is in the same state after
//!   one or several. An accepted Hello begins a new session, which forgets the previous session's
//!   sequence numbers, configuration number, target number and wiring that is not in force.
//! - [`Configure`](message::Command::Configure), [`Target`](message::Command::Target),
//!   [`Jog`](message::Command::Jog), [`Hold`](message::Command::Hold),
//!   [`ClearFault`](message::Command::ClearFault), [`Store`](message::Command::Store),
//!   [`Home`](message::Command::Home), [`TestFlash`](message::Command::TestFlash): safe to repeat
//!   with the same [`id`](ToBoard::id). The board remembers the last of these commands that it
//!   executed. It answers a request with the same id and bytes again, but does not execute it
//!   again: a repeated Jog moves once, a repeated ClearFault clears no later fault. A host must
//!   give every new request a new id. Ids may wrap, because a repetition directly follows its
//!   request.
//! - [`Answer`](message::FromBoard::Answer): carries the request's id and the board's time. A host
//!   that waits for an answer repeats the request, and ignores answers with other ids.
//! - [`Telemetry`](message::FromBoard::Telemetry): names the configuration and the target that it
//!   describes, by the ids of the commands that set them. A host ignores telemetry about another
//!   target, in whatever order it arrives. Telemetry is not repeated: the board sends the next one
//!   after each accepted position, and at least every 100 ms.
//! - [`Drivers`](message::FromBoard::Drivers): not repeated. The next one, about 0.1 s later,
//!   replaces it.
//! - [`Fault`](message::FromBoard::Fault): sent once. A host that misses it finds the fault in the
//!   telemetry, whose state stays [`Fault`](message::State::Fault) until ClearFault.
//! - A board that restarts forgets Hello, configuration and target. It refuses positions with
//!   [`NotGreeted`](message::Refusal::NotGreeted), and answers the next Hello with the
//!   [cause](message::FromBoard::Started) of its restart.
//!
//! # Compatibility
//! [`Hello`](message::Command::Hello), [`Stop`](message::Command::Stop),
//! [`Bootloader`](message::Command::Bootloader) and
//! [`Provenance`](message::FromBoard::Provenance) never change their bytes. All other messages may
//! change with [`SCHEMA`], which is derived from the types: a board refuses to move for a host with
//! another schema, and reports the mismatch. Enums only grow at their end.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod boards;
pub mod config;
pub mod diagnostics;
pub mod dimension;
pub mod frame;
pub mod message;
mod pins;
pub mod prior;
pub mod provenance;
mod schema;
mod text;
pub mod units;
pub mod wiring;

pub use config::Config;
pub use diagnostics::panic_place;
pub use dimension::{AXES, MAX_MOTORS, MOTORS, MotorList, PerAxis, PerMotor};
pub use message::{Command, FromBoard, Hello, MAGIC, SCHEMA, ToBoard, VERSION};
pub use provenance::{Provenance, RELEASE};
pub use wiring::Wiring;
