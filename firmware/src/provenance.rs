//! The program and the chip, for the host.

use embassy_rp::rom_data;
use plumb_protocol::provenance::{BoardKind, Commit, Provenance, RELEASE};

/// Source of this program, as scripts/firmware tells it.
const COMMIT: Option<Commit> = match option_env!("PLUMB_COMMIT") {
    Some(text) => Commit::parse(text),
    None => None,
};

/// Returns the provenance of this program and this chip.
pub(crate) fn provenance() -> Provenance {
    Provenance { release: RELEASE, commit: COMMIT, board: BoardKind::Pico, stepping: stepping() }
}

/// Returns the chip's stepping, which the version of its boot ROM tells (RP2040 data sheet,
/// appendix B: each stepping has a boot ROM of its own).
fn stepping() -> Option<[u8; 2]> {
    match rom_data::rom_version_number() {
        1 => Some(*b"B0"),
        2 => Some(*b"B1"),
        3 => Some(*b"B2"),
        _ => None,
    }
}
