//! The real firmware of a Pico 2 in an emulated RP2350 (the crate `rp2350-emu`), in lock step: the
//! chip's time passes only during calls. The host talks to it over UART0.
//!
//! What the emulator lacks is repaired from outside, without a change of its code:
//!
//! | it lacks | repair |
//! |---|---|
//! | a boot ROM, which no registry has | a [stub](chip) of one: its version, and a lookup that finds nothing |
//! | load-acquire and store-release | the image gets [plain ones](image), which do the same on one processor |
//! | STIR, and priorities of interrupts that are written by bytes | the [bus] sees the writes |
//! | reading MSP while it is the stack pointer | the copy that is read is set before each instruction |
//! | lazy saving of the FPU's registers in nested interrupts | they are saved at once, which takes longer |
//! | time that passes for a processor that sleeps; interrupts that end WFE | the [processor's loop](chip) is here |
//! | the crystal's clock, by which TICKS counts microseconds | the [bus] counts the system's |
//! | the DMA's reload of its count, and AL2 without a start | the [bus] does both |
//! | a receiver in UART0 | a [UART](uart) of its own on the bus |
//! | functions and overrides of pins (IO_BANK0) | none: the [pins] are what PIO0 drives |
//! | a USB that is more than its registers | none: the firmware finds no host there |
//! | a watchdog that bites, and a restart | none |
//!
//! Flash is read without a cache miss there, so that the clocks of code in flash are the least that
//! a chip takes.
#![deny(missing_docs)]

mod bus;
pub mod chip;
pub mod image;
pub mod pins;
pub mod uart;
pub mod watch;

pub use chip::Chip;
pub use image::{Firmware, firmware_image};
