//! Lists of images in a TUM RGB-D folder.

use std::path::{Path, PathBuf};

use plumb_config::bounded_read;

use super::error::TumError;

/// Largest time difference between a colour image and its depth image, seconds. It is below the
/// 33 ms between frames, so that the neighbour of a missing depth image does not replace it.
pub const MAX_TIME_DIFFERENCE: f64 = 0.020;

/// Most lines of a list: 9 hours at 30 Hz.
pub const MAX_LINES: usize = 1_000_000;

/// Most bytes of a list: [`MAX_LINES`] lines of 67 bytes.
pub const MAX_LIST_BYTES: u64 = 1 << 26;

/// Largest absolute time stamp, seconds. Up to there an `f64` is exact to a microsecond. Time
/// stamps in nanoseconds since 1970 are above it.
const MAX_TIME: f64 = 1e10;

/// Line of a list.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    /// Time stamp, seconds.
    pub(super) time: f64,
    /// Path of the image.
    pub(super) path: PathBuf,
}

/// Colour picture with its depth picture, a line of an association file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pair {
    /// The colour picture; its time is that of the pair.
    pub(super) colour: Entry,
    /// Path of the depth picture.
    pub(super) depth: PathBuf,
}

/// Lines of a list; one that is no entry is an error of its own.
pub(super) type Lines<T> = Vec<Result<T, TumError>>;

/// Reads the list `name` in `folder`.
///
/// # Errors
/// Where the list cannot be read or is too long.
pub(super) fn read_list(folder: &Path, name: &str) -> Result<Lines<Entry>, TumError> {
    read_lines(folder, name, "timestamp path", parse_entry)
}

/// Reads the association file `name` in `folder`.
///
/// # Errors
/// As [`read_list`].
pub(super) fn read_pairs(folder: &Path, name: &str) -> Result<Lines<Pair>, TumError> {
    read_lines(folder, name, "timestamp path timestamp path", parse_pair)
}

/// Reads the lines of the file `name` in `folder`, of this `form`.
fn read_lines<T>(
    folder: &Path,
    name: &str,
    form: &'static str,
    parse: impl Fn(&Path, &str) -> Option<T>,
) -> Result<Lines<T>, TumError> {
    let path = folder.join(name);
    let bytes = bounded_read::read(&path, MAX_LIST_BYTES)?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.trim_start_matches('\u{feff}').lines();
    if lines.clone().nth(MAX_LINES).is_some() {
        return Err(TumError::TooManyLines { path, limit: MAX_LINES });
    }
    Ok(lines
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(line, text)| {
            parse(folder, text).ok_or_else(|| TumError::Line {
                path: path.clone(),
                line,
                form,
                text: bounded_read::excerpt(text),
            })
        })
        .collect())
}

/// Returns the first of `names` that `folder` has; `None` where it has none.
pub(super) fn present<'a>(folder: &Path, names: &[&'a str]) -> Option<&'a str> {
    names.iter().copied().find(|name| folder.join(name).exists())
}

/// Parses `timestamp path`; `None` where the line is something else. Commas separate as spaces do,
/// and further columns are left out, as in TUM's own tools; a file may have spaces in its name.
fn parse_entry(folder: &Path, line: &str) -> Option<Entry> {
    let separates = |c: char| c.is_whitespace() || c == ',';
    let (time, rest) = line.split_once(separates)?;
    let time: f64 = time.parse().ok()?;
    let rest = rest.trim_matches(separates);
    let first = rest.split(separates).next().filter(|first| !first.is_empty())?;
    let whole = folder.join(rest);
    let path = if first == rest || whole.exists() { whole } else { folder.join(first) };
    (time.abs() <= MAX_TIME).then_some(Entry { time, path })
}

/// Parses `timestamp path timestamp path` of a colour and a depth picture, as TUM's `associate.py`
/// prints it: the picture with "depth" in its path is that of depth, and the second one where that
/// tells nothing. `None` where the line is something else.
fn parse_pair(folder: &Path, line: &str) -> Option<Pair> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    let [first_time, first, second_time, second] = fields[..] else { return None };
    let entry = |time: &str, path: &str| parse_entry(folder, &format!("{time} {path}"));
    let (first, second) = (entry(first_time, first)?, entry(second_time, second)?);
    let is_depth = |entry: &Entry| {
        let path = entry.path.strip_prefix(folder).unwrap_or(&entry.path);
        path.to_string_lossy().to_lowercase().contains("depth")
    };
    let is_swapped = is_depth(&first) && !is_depth(&second);
    let (colour, depth) = if is_swapped { (second, first) } else { (first, second) };
    Some(Pair { colour, depth: depth.path })
}

/// Returns the entry of `sorted` (by time) nearest to `time`; `None` where it differs by more than
/// [`MAX_TIME_DIFFERENCE`].
pub(super) fn nearest(sorted: &[Entry], time: f64) -> Option<&Entry> {
    let after = sorted.partition_point(|e| e.time < time);
    let distance = |e: &&Entry| (e.time - time).abs();
    let candidates = sorted[after.saturating_sub(1)..].iter().take(2);
    candidates
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .filter(|e| distance(e) <= MAX_TIME_DIFFERENCE)
}
