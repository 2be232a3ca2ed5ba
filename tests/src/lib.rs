//! What the whole-system tests in `tests/` share: a board in virtual time, rigs that misbehave,
//! links that are slow, lossy and interrupted.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

pub mod bench;
pub mod chip;
pub mod links;
pub mod plants;
