//! What a board has counted since its start, for a report of a problem.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::message::StartCause;

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
