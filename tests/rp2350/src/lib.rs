//! The real firmware of a Pico 2 in an emulated RP2350 (the crate `rp2350-emu`), in lock step: the
//! chip's time passes only during calls. The host talks to it over UART0.
//!
//! What the emulator lacks is repaired from outside, without a change of its code:
//!
//! - A boot ROM, which no registry has: a [stub](chip) tells its version, and finds no function.
//! - Load-acquire, store-release, VPUSH of double registers, the places of two fields in VSEL,
//!   VMAXNM and VMINNM: the image gets [others](image) that do
//!   the same.
//! - STIR, and priorities of interrupts that are written by bytes: the bus sees the writes.
//! - Reading MSP while it is the stack pointer: the copy that is read is set before each
//!   instruction.
//! - Lines of interrupts: what pends while its own handler runs is dropped, since it is the cause
//!   that the handler has not cleared yet. The handler would run twice.
//! - Lazy saving of the FPU's registers in nested interrupts: they are saved at once, which takes
//!   longer.
//! - Time that passes for a processor that sleeps, and interrupts that end WFE: the
//!   [processor's loop](chip) is here.
//! - The crystal's clock, by which TICKS counts microseconds: the bus counts the system's.
//! - The DMA's reload of its count, and AL2_TRANS_COUNT without a start: the bus does both.
//! - A receiver in UART0: a [UART](uart) of its own is on the bus.
//!
//! What it lacks besides: functions and overrides of pins (IO_BANK0), so that the [pins] are what
//! PIO0 drives; a USB that is more than its registers; a watchdog that bites, and a restart.
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
