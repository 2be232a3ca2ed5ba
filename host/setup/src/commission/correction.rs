//! The text of a rig file with other directions of the motors. Everything else stays as it is.

use plumb_config::toml_text::{TomlError, TomlText};
use thiserror::Error;

/// Reason why the directions in a rig file's text could not be replaced.
#[derive(Debug, Error)]
#[error("the rig file has no [motors]")]
pub struct NoMotors(#[source] Option<TomlError>);

/// Returns the rig file's text with `motors.reversed`. A comment behind the old value stays.
///
/// # Errors
/// Where the text is no TOML or lacks the table.
pub fn corrected(text: &str, reversed: [bool; 3]) -> Result<String, NoMotors> {
    let mut file = TomlText::parse(text).map_err(|error| NoMotors(Some(error)))?;
    let mut motors = file.table("motors", None).ok_or(NoMotors(None))?;
    motors.set("reversed", &format!("{reversed:?}"));
    Ok(file.text())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../../rigs/paper.toml");

    #[test]
    fn only_the_directions_change() {
        let new = corrected(PAPER, [true, false, true]).unwrap();
        let old = "reversed = [false, false, false]";
        assert!(PAPER.contains(old));
        assert_eq!(new, PAPER.replace(old, "reversed = [true, false, true]"));
        assert!(corrected("[board]\n", [true; 3]).is_err());
    }
}
