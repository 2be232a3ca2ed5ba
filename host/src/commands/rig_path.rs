//! The rig file of a command line: its path, which a variable may name, and words that are none.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Args;

use super::number_list::place_in;
use super::words::{aim_hint, goto_command, is_file_name, is_list, port_in};
use super::{Failure, bad_input};

/// Environment variable with the rig file of a command line that names none.
pub(crate) const RIG_VARIABLE: &str = "PLUMB_RIG";

/// The rig file of a command that needs one.
#[derive(Args)]
pub(crate) struct RigArg {
    /// Rig file (TOML, SI units)
    #[arg(value_name = "RIG", env = RIG_VARIABLE, hide_env_values = true, value_parser = rig_path)]
    pub(crate) rig: PathBuf,
}

/// Splits the words of `plumb COMMAND [RIG] VALUE...` into the rig file and the values, whose names
/// in `usage` are `names`. Without a rig file among the words it is that of [`RIG_VARIABLE`].
///
/// # Errors
/// Where the number of words is wrong, or nothing names the rig file.
pub(crate) fn split_rig(
    words: impl IntoIterator<Item = Option<String>>,
    names: &[&str],
    usage: &str,
) -> Result<(PathBuf, Vec<String>), Failure> {
    let mut words: Vec<String> = words.into_iter().flatten().collect();
    if words.len() == names.len() + 1 {
        let is_number = |word: &String| word.parse::<f64>().is_ok();
        if !names.is_empty() && words.iter().all(is_number) && !Path::new(&words[0]).exists() {
            let names = names.join(" ");
            return Err(bad_input(format!("too many numbers: {names} are needed; usage: {usage}")));
        }
        check_rig_first(&words, usage)?;
        let rig = words.remove(0);
        let rig = rig_path(&rig)
            .map_err(|why| bad_input(format!("invalid value '{rig}' for '[RIG]': {why}")))?;
        return Ok((rig, words));
    }
    let has_rig = words.first().is_some_and(|word| is_file_name(word));
    let missing = names.get(words.len() - usize::from(has_rig)..).unwrap_or_default();
    if !missing.is_empty() {
        let missing = missing.join(", ");
        let last = words.last().map(String::as_str).unwrap_or_default();
        if let Some(place) = place_in(last).filter(|_| names.len() == 3) {
            let rig = if has_rig { Some(words[0].as_str()) } else { absent_rig() };
            return Err(bad_input(format!("write {}", goto_command(rig, &place))));
        }
        let hint = aim_hint(last).map(|hint| format!("; {hint}")).unwrap_or_default();
        return Err(bad_input(format!("the command line lacks {missing}{hint}; usage: {usage}")));
    }
    match std::env::var_os(RIG_VARIABLE).filter(|path: &OsString| !path.is_empty()) {
        Some(rig) => Ok((rig.into(), words)),
        None => Err(no_rig("", usage)),
    }
}

/// Checks that the rig file does not stand behind the values: `goto 0.4 0.4 0.2 rig.toml`.
///
/// # Errors
/// Where the last of `words` is a rig file by its name, and the first one is no file.
pub(crate) fn check_rig_first(words: &[String], usage: &str) -> Result<(), Failure> {
    let [first, .., last] = words else { return Ok(()) };
    if is_file_name(last) && !is_file_name(first) && !Path::new(first).exists() {
        return Err(bad_input(format!("put the rig file {last} first; usage: {usage}")));
    }
    Ok(())
}

/// Returns how a command that is to be typed names the rig file where the command line has none:
/// not at all where a variable names it.
pub(super) fn absent_rig() -> Option<&'static str> {
    if has_variable() { None } else { Some("RIG") }
}

/// Returns whether [`RIG_VARIABLE`] names a file.
fn has_variable() -> bool {
    std::env::var_os(RIG_VARIABLE).is_some_and(|path| !path.is_empty())
}

/// Returns the failure of a command line without a rig file, and without `others`.
pub(super) fn no_rig(others: &str, usage: &str) -> Failure {
    bad_input(format!(
        "no rig file is named: put it first, or set {RIG_VARIABLE} (`plumb init` writes one)\
         {others}; usage: {usage}"
    ))
}

/// Returns the path of a rig file from the command line of a command with `--port`.
///
/// # Errors
/// As [`rig_path_without_port`].
pub(crate) fn rig_path(text: &str) -> Result<PathBuf, String> {
    rig_path_else(text, |port| format!("give it with --port {port}"))
}

/// Returns the path of a rig file from the command line of a command that can do without one. It is
/// empty where [`RIG_VARIABLE`] is.
///
/// # Errors
/// As [`rig_path_without_port`].
pub(crate) fn optional_rig_path(text: &str) -> Result<PathBuf, String> {
    if text.is_empty() && is_variable(text) { Ok(PathBuf::new()) } else { rig_path(text) }
}

/// Returns the rig file of a command that can do without one; `None` for an empty path.
pub(crate) fn named(rig: Option<&Path>) -> Option<&Path> {
    rig.filter(|path| !path.as_os_str().is_empty())
}

/// Returns whether [`RIG_VARIABLE`] has this value.
pub(crate) fn is_variable(text: &str) -> bool {
    std::env::var(RIG_VARIABLE).is_ok_and(|rig| rig == text)
}

/// Returns the path of a rig file from the command line of a command without `--port`.
///
/// # Errors
/// Where it is empty, it is a list of places, another aim or a port by its name, a folder, or a
/// word that is no file.
pub(crate) fn rig_path_without_port(text: &str) -> Result<PathBuf, String> {
    rig_path_else(text, |_| "this command opens no port".to_owned())
}

/// Returns the path of a rig file from the command line. Where it is a port, the error ends with
/// `port_advice`.
///
/// # Errors
/// As [`rig_path_without_port`].
pub(crate) fn rig_path_else(
    text: &str,
    port_advice: impl Fn(&str) -> String,
) -> Result<PathBuf, String> {
    if text.is_empty() {
        return Err(format!("no rig file has an empty name (is {RIG_VARIABLE} set to nothing?)"));
    }
    // A person who did not type the name learns where it comes from when the file is read.
    if is_variable(text) {
        return Ok(text.into());
    }
    if let Some(hint) = aim_hint(text).filter(|_| is_list(text) || !Path::new(text).exists()) {
        return Err(format!("this is no rig file; {hint}"));
    }
    if let Some(port) = port_in(text) {
        let advice = port_advice(&port.display().to_string());
        return Err(format!("a port is no rig file: {advice}"));
    }
    if is_mere_word(text) {
        let advice = match has_variable() {
            true => format!("{RIG_VARIABLE} names that already: leave the word out"),
            false => "write its name, such as rig.toml (`plumb init` writes one)".to_owned(),
        };
        let why = "no file has this name, and the word is taken for the rig file";
        return Err(format!("{why}; {advice}"));
    }
    let inside = Path::new(text).join("rig.toml");
    if inside.is_file() {
        return Err(format!(
            "{text} is a folder, but must be a regular file: its rig file is {}",
            inside.display()
        ));
    }
    Ok(text.into())
}

/// Returns whether `text` of the command line is no file, and does not look like one.
pub(super) fn is_mere_word(text: &str) -> bool {
    let path = Path::new(text);
    let has_ending = path.extension().is_some() && text.parse::<f64>().is_err();
    !has_ending && !text.contains('/') && !path.exists() && !is_variable(text)
}
