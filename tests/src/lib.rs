//! Shared parts of the whole-system tests in `tests/`: a board in virtual time, faulty rigs, slow,
//! lossy and interrupted links, and the firmware in the emulated chip.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

pub mod bench;
pub mod chip;
pub mod commissioning;
pub mod defects;
pub mod in_time;
pub mod links;
pub mod live_camera;
pub mod noise;
pub mod parallel;
pub mod plain_room;
pub mod planar;
pub mod plants;
pub mod reversals;
pub mod soak;
pub mod source_tree;
pub mod tensions;

/// Returns whether the long form of a test is wanted, as by `make test-all`, `make faults` and
/// `make bounce`: `PLUMB_LONG` is set.
pub fn is_long() -> bool {
    std::env::var_os("PLUMB_LONG").is_some()
}
