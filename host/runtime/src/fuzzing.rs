//! Entrance for the fuzz targets in `tests/fuzz` to the check of a rig file's text.

use std::path::Path;

use crate::rig::check::{BoardCheck, Finding, check_text};

/// Checks the text of a rig file, without its camera file.
pub fn check_rig_text(text: &str, board: BoardCheck<'_>) -> Vec<Finding> {
    check_text(Path::new("rig.toml"), text, board).0
}
