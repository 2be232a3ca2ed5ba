//! What a chip measures of its own pulses and clock, for a self-test.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

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
    /// Pulses at the pins of motors A, B and C.
    pub pulses: [PulseCount; 3],
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
