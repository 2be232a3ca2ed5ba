//! What a word of the command line is, by its look, and how it is given to the program.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use plumb_path::shape::ShapeKind;
use plumb_runtime::link::is_pseudo_terminal;

use super::number_list::place_in;
use super::numbers::COORDINATE;

/// Mean time between two places of a file above which their times seem to be in another unit,
/// seconds.
const LONG_PAUSE_S: f64 = 5.0;

/// Endings of the names of lists of places.
const LISTS: [&str; 5] = ["csv", "gcode", "nc", "ngc", "jsonl"];

/// How a list of places is given to the program, for messages.
pub(crate) const DRIVES_THROUGH_LIST: &str =
    "`plumb run RIG --waypoints FILE` or `--path FILE` drives through it";

/// Returns whether a file is a serial port by its name, or the port of an emulated board.
pub(crate) fn is_port(file: &Path) -> bool {
    let is_terminal = |name: &OsStr| name.to_string_lossy().starts_with("tty");
    file.starts_with("/dev/serial")
        || is_pseudo_terminal(file)
        || (file.starts_with("/dev") && file.file_name().is_some_and(is_terminal))
}

/// Returns the port that `word` names, whole or without its folder; `None` for another word.
pub(crate) fn port_in(word: &str) -> Option<PathBuf> {
    let is_bare = word.starts_with("tty") && !Path::new(word).exists();
    let port = if is_bare { Path::new("/dev").join(word) } else { word.into() };
    is_port(&port).then_some(port)
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
        let place = place_in(word)?;
        Some(format!("to go to one place: {}", goto_command(Some("RIG"), &place)))
    }
}

/// Returns the command that drives to `place`, three numbers with spaces between them. Numbers that
/// are too large for metres are taken for millimetres.
pub(crate) fn goto_command(rig: Option<&str>, place: &str) -> String {
    match in_metres(rig, place) {
        Some(command) => format!("{command}, in metres, if these are millimetres"),
        None => command_to(rig, place),
    }
}

/// Returns the command that drives to `place`, in metres, where its numbers must be millimetres;
/// `None` for other ones.
pub(crate) fn in_metres(rig: Option<&str>, place: &str) -> Option<String> {
    metres_of_millimetres(place).map(|place| command_to(rig, &place))
}

fn command_to(rig: Option<&str>, place: &str) -> String {
    let rig = rig.map(|rig| format!("{rig} ")).unwrap_or_default();
    format!("`plumb goto {rig}{place}`")
}

/// Returns `place` in metres where it must be in millimetres; `None` for any other one.
fn metres_of_millimetres(place: &str) -> Option<String> {
    let numbers: Vec<f64> = place.split(' ').map(str::parse).collect::<Result<_, _>>().ok()?;
    let metres = numbers.iter().map(|number| number / 1000.0);
    let metres: Vec<String> =
        metres.filter(|it| COORDINATE.contains(*it)).map(|it| it.to_string()).collect();
    let is_far = numbers.iter().any(|number| !COORDINATE.contains(*number));
    (is_far && metres.len() == numbers.len()).then(|| metres.join(" "))
}

/// Returns the doubt about the unit of `t` in a file of so many places that take `span_s` seconds,
/// as the end of a message; empty where there is none.
pub(crate) fn time_doubt(places: usize, span_s: f64) -> &'static str {
    match span_s > LONG_PAUSE_S * places as f64 {
        true => " (is its `t` in milliseconds? It must be in seconds)",
        false => "",
    }
}

/// Returns whether a word of the command line names a file, and is no value.
pub(crate) fn is_file_name(word: &str) -> bool {
    Path::new(word).extension().is_some_and(|extension| extension == "toml")
}
