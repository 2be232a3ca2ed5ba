//! Entrance for the fuzz targets in `tests/fuzz` and for wrong rig files in `tests`.

use std::path::Path;

use plumb_protocol::Wiring;

use crate::rig::check::{BoardCheck, Finding, check_text};
use crate::rig::{OutOfRange, Rig};

/// Checks the text of a rig file, without its camera file.
pub fn check_rig_text(text: &str, board: BoardCheck<'_>) -> Vec<Finding> {
    check_text(Path::new("rig.toml"), text, board).0
}

/// Returns the wiring of `rig`, also one that the board refuses.
///
/// # Errors
/// The first value that is beyond the range of the wire.
pub fn unchecked_wiring(rig: &Rig) -> Result<Wiring, OutOfRange> {
    rig.unchecked_wiring()
}
