//! What a Plumb host and its board say to each other: messages, units on the wire, and framing.
//!
//! A message ([`ToBoard`] or [`FromBoard`]) is serialised with postcard, closed with its CRC-32 and wrapped in a
//! COBS frame that ends with a zero byte ([`frame`]), so that it passes over any stream of bytes: USB-CDC, a UART,
//! a pseudo-terminal, memory. This crate knows no control: it says what the words are, not what they do.
//!
//! # Compatibility
//! [`Hello`](message::Command::Hello), [`Stop`](message::Command::Stop) and
//! [`Bootloader`](message::Command::Bootloader) keep their bytes for ever. Everything else may change with
//! [`SCHEMA`], which is derived from the types: a board refuses to move for a host of another schema, and says so.
//! Enums only grow at their end.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod config;
pub mod frame;
pub mod message;
mod text;
pub mod units;

pub use config::Config;
pub use message::{Command, FromBoard, Hello, MAGIC, SCHEMA, ToBoard, VERSION};
