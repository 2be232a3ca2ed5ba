//! The firmware of a Pico 2 in an emulated RP2350. The tests are skipped without the firmware,
//! except with CI set.
#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

mod agrees;
mod timing;
