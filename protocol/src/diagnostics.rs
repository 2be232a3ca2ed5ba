//! What a board has counted since its start, for a report of a problem; what its chip measures of
//! its own pulses and clock, for a self-test; and the number of the place where its program
//! panicked.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::dimension::MotorList;
use crate::frame::CRC;

/// Cause of a board's start. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartCause {
    /// Power on; on an RP2040 also a brown-out of the supply.
    PowerOn,
    /// Reset pin.
    ResetPin,
    /// Watchdog: the program hung, or its stack overflowed.
    Watchdog,
    /// Panic of the program, at the place with this number ([`panic_place`]).
    Panic(u32),
    /// Hard fault of the processor: an invalid instruction or address.
    HardFault,
    /// Intended restart, for example after an update.
    Requested,
    /// Brown-out: the supply was too low for a moment. An RP2350 tells it apart from power on.
    BrownOut,
}

/// Answer to a [`Diagnose`](crate::Command::Diagnose) command.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Diagnostics {
    /// The command's [`ToBoard::id`](crate::ToBoard::id).
    pub id: u16,
    /// Cause of the board's last start.
    pub start: StartCause,
    /// See [`Telemetry::bad_frames`](crate::message::Telemetry::bad_frames).
    pub bad_frames: u16,
    /// Counts of the chip.
    pub chip: ChipCounts,
}

/// What a chip has counted since its start. Counts saturate. An emulated board has the
/// [default](Default): it has no chip.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChipCounts {
    /// Ticks that came late while motors turned: each delayed the pulses.
    pub late_ticks: u32,
    /// Ticks that came late at standstill: at the start, with a new configuration, while the
    /// configuration was stored.
    pub late_at_rest: u32,
    /// Bytes of the stack that were never used; `None` where that is unknown.
    pub free_stack: Option<u32>,
    /// Resets of USB after a transfer that did not end.
    pub usb_resets: u16,
    /// Place of the processor's fault, where that was the cause of the last start.
    pub fault: Option<ProcessorFault>,
    /// Frames to the host that were dropped for want of room: the host, or the link, is too slow.
    pub dropped_frames: u32,
}

/// Registers at a fault of the processor.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProcessorFault {
    /// Address of the instruction; 0 where the stack had overflowed, and no register could be
    /// saved.
    pub pc: u32,
    /// The link register: an address in the function that had called last.
    pub lr: u32,
}

impl fmt::Display for ProcessorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:#010x}, last called from {:#010x}", self.pc, self.lr)
    }
}

/// Answer to a [`Measure`](crate::Command::Measure) command. Differences of two measurements count.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Measurement {
    /// The command's [`ToBoard::id`](crate::ToBoard::id).
    pub id: u16,
    /// What the chip has measured.
    pub chip: ChipMeasurement,
}

/// What a chip has measured.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChipMeasurement {
    /// Pulses at the pins of each motor.
    pub pulses: MotorList<PulseCount>,
    /// Time on the chip's clock, microseconds; wraps.
    pub time_us: u32,
    /// Number of the last frame of USB, 0 to 2047; wraps. A host begins one every millisecond.
    /// `None` where USB is not connected.
    pub usb_frame: Option<u16>,
}

/// Pulses that were counted at the pins of a motor; both wrap.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PulseCount {
    /// Rising edges of STEP with DIR low.
    pub low: u32,
    /// Rising edges of STEP with DIR high.
    pub high: u32,
}

/// Returns the number of a place in the source: the CRC-32 of the file's path, as the compiler
/// gives it, and of the line, little endian. It fits a register that keeps its content over a
/// restart. `scripts/panic-place` finds the place again.
pub fn panic_place(file: &str, line: u32) -> u32 {
    let mut digest = CRC.digest();
    digest.update(file.as_bytes());
    digest.update(&line.to_le_bytes());
    digest.finalize()
}
