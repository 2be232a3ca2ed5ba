//! What a word of the command line is, by its look, and how it is given to the program.

use std::ffi::OsStr;
use std::path::Path;
use std::str::FromStr;

use plumb_path::shape::ShapeKind;
use plumb_runtime::link::is_pseudo_terminal;

use crate::commands::number_list::place_in;

/// Endings of the names of lists of places.
const LISTS: [&str; 5] = ["csv", "gcode", "nc", "ngc", "jsonl"];

/// How a list of places is given to the program, for messages.
pub(super) const DRIVES_THROUGH_LIST: &str =
    "`plumb run RIG --waypoints FILE` or `--path FILE` drives through it";

/// Returns whether a file is a serial port by its name, or the port of an emulated board.
pub(crate) fn is_port(file: &Path) -> bool {
    let is_terminal = |name: &OsStr| name.to_string_lossy().starts_with("tty");
    file.starts_with("/dev/serial")
        || is_pseudo_terminal(file)
        || (file.starts_with("/dev") && file.file_name().is_some_and(is_terminal))
}

/// Returns whether the name of a file is that of a list of places.
pub(crate) fn is_list(name: &str) -> bool {
    let ending = Path::new(name).extension().unwrap_or_default().to_ascii_lowercase();
    LISTS.iter().any(|list| ending == *list)
}

/// Returns the option for the shape `word`; `None` for another word.
pub(crate) fn shape_option(word: &str) -> Option<String> {
    ShapeKind::from_str(word).is_ok().then(|| format!("--path {word}"))
}

/// Returns the command for the aim `word`, a list of places, a shape or a place, that stands where
/// a command does not have it; `None` for another word.
pub(crate) fn aim_hint(word: &str) -> Option<String> {
    if is_list(word) {
        Some(format!("for a list of places: {DRIVES_THROUGH_LIST}"))
    } else if let Some(option) = shape_option(word) {
        Some(format!("for a shape: `plumb run RIG {option}`"))
    } else {
        place_in(word).map(|place| format!("to go to one place: `plumb goto RIG {place}`"))
    }
}

/// Returns whether a word of the command line names a file, and is no value.
pub(crate) fn is_file_name(word: &str) -> bool {
    Path::new(word).extension().is_some_and(|extension| extension == "toml")
}
