//! Description of the firmware for picotool and for the host.
//!
//! `picotool info -a` prints program, version and pins of a file with this firmware, or of a board
//! in its bootloader; the linker places the header and the list of the entries. The host gets the
//! provenance of the program and the chip.

use core::ffi::{CStr, c_char};

use embassy_rp::binary_info::{self, DataType, EntryAddr, consts};
use plumb_protocol::provenance::{Commit, Provenance, RELEASE};

use crate::chip;

/// Names of pins (the SDK's `binary_info_pins_with_name_t`).
#[repr(C)]
struct PinNames {
    kind: DataType,
    tag: u16,
    /// A bit for each pin.
    mask: u32,
    /// Names in the order of the pins, with `|` between them.
    names: *const c_char,
}

// SAFETY: the pointer is to a string that never changes.
unsafe impl Sync for PinNames {}

impl PinNames {
    const fn new(mask: u32, names: &'static CStr) -> Self {
        let (kind, tag) = (DataType::PinsWithName, consts::TAG_RASPBERRY_PI);
        Self { kind, tag, mask, names: names.as_ptr() }
    }
}

/// Pins of the default wiring of a Pico (docs/use/board.md): GP0 to GP17, and the LED. A rig may be
/// wired to others.
static PINS: PinNames = PinNames::new(
    0x3_ffff | 1 << 25,
    c"UART TX|UART RX|A STEP or A1+|A DIR or A1-|B STEP or A2+|B DIR or A2-|C STEP or B1+|\
      C DIR or B1-|B2+|B2-|C1+|C1-|C2+|C2-|ENABLE|EMERGENCY|SDA|SCL|LED",
);

/// Entries of the list.
#[used]
#[unsafe(link_section = ".bi_entries")]
static ENTRIES: [EntryAddr; 4] = [
    binary_info::rp_program_name!(c"Plumb board"),
    binary_info::rp_cargo_version!(),
    binary_info::rp_program_description!(c"Moves a ball on three cables"),
    binary_info::rp_pico_board!(chip::PICO_BOARD),
];

/// Entries of types that the library lacks.
#[used]
#[unsafe(link_section = ".bi_entries")]
static PIN_ENTRIES: [&PinNames; 1] = [&PINS];

/// Source of this program, as scripts/firmware tells it.
const COMMIT: Option<Commit> = match option_env!("PLUMB_COMMIT") {
    Some(text) => Commit::parse(text),
    None => None,
};

/// Returns the provenance of this program and this chip.
pub(crate) fn provenance() -> Provenance {
    Provenance { release: RELEASE, commit: COMMIT, board: chip::BOARD, stepping: chip::stepping() }
}
