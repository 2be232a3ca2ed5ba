//! File that a run follows: a path, places to stop at, or a target that moves.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use plumb_config::bounded_read::{ReadError, read_text};
use plumb_config::error_chain::ErrorChain;
use plumb_config::mistake::{FileMistakes, Mistake};
use plumb_config::toml_file::MAX_BYTES;
use plumb_path::file::{Kind, Place, Places, Unit, parse};
use thiserror::Error;

use super::Waypoint;
use crate::rig::{MotionError, MotionRules};
use crate::targets::{FileTarget, TargetLine};

/// Largest file of targets in JSON, bytes: an hour at 200 Hz.
const MAX_TARGET_BYTES: u64 = 1 << 27;

/// Contents of a file that a run follows.
#[derive(Debug, Clone, PartialEq)]
pub enum FollowFile {
    /// Places of a path. [`misplaced`] tells those that a rig does not allow.
    Path(Places),
    /// Places to stop at, which the rig allows.
    Stops(Vec<Waypoint>),
    /// Targets with their times, at places that the rig allows.
    Targets(Vec<FileTarget>),
}

/// Failure to read a file that a run follows.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FollowFileError {
    /// The file cannot be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has mistakes.
    #[error(transparent)]
    Mistakes(#[from] FileMistakes),
}

impl FollowFile {
    /// Reads the file at `path`: a table of places, G-code, or targets as lines of JSON. What it
    /// holds decides.
    ///
    /// # Errors
    /// Where it cannot be read, has a mistake, or a place to stop at or a target that `rules` do
    /// not allow; all mistakes at once.
    pub fn read(path: &Path, rules: &MotionRules) -> Result<Self, FollowFileError> {
        let text = read_text(path, MAX_TARGET_BYTES)?;
        if is_json(&text) {
            let read = targets(&text, rules).map(Self::Targets);
            return read.map_err(|mistakes| mistakes_in(path, mistakes).into());
        }
        let mut places = places(path, &text)?;
        in_metres(&mut places, rules).map_err(|mistake| mistakes_in(path, vec![mistake]))?;
        Ok(match places.kind {
            Kind::Path | Kind::Timed => Self::Path(places),
            Kind::Stops => {
                let stops = stops(&places, rules);
                Self::Stops(stops.map_err(|mistakes| mistakes_in(path, mistakes))?)
            }
        })
    }

    /// Checks, before two jogs have measured the picture, that the file at `path` has pixels.
    ///
    /// # Errors
    /// Where it cannot be read, has a mistake, or has no pixels.
    pub fn check_pixels(path: &Path) -> Result<(), FollowFileError> {
        match places(path, &read_text(path, MAX_BYTES)?)?.unit {
            Unit::Pixels => Ok(()),
            Unit::Metres => Err(mistakes_in(path, vec![metres_in_picture()]).into()),
        }
    }
}

/// Returns the places of the `text` of the file at `path`.
fn places(path: &Path, text: &str) -> Result<Places, FollowFileError> {
    let (found, limit) = (text.len() as u64, MAX_BYTES);
    if found > limit {
        return Err(ReadError::TooLarge { path: path.to_owned(), found, limit }.into());
    }
    parse(text).map_err(|mistakes| mistakes_in(path, mistakes).into())
}

/// Turns places in pixels into metres of the picture's frame.
fn in_metres(places: &mut Places, rules: &MotionRules) -> Result<(), Mistake> {
    match (places.unit, rules.picture()) {
        (Unit::Metres, None) => Ok(()),
        (Unit::Metres, Some(_)) => Err(metres_in_picture()),
        (Unit::Pixels, None) => {
            let message = "columns u and v need a rig file with [plane]";
            Err(Mistake::of_line(1, message.to_owned()))
        }
        (Unit::Pixels, Some(picture)) => {
            for Place { position, .. } in &mut places.places {
                *position = picture.place([position.y, position.z]).into();
            }
            places.unit = Unit::Metres;
            Ok(())
        }
    }
}

/// Returns the mistake of a file in metres for a rig with `[plane]`.
fn metres_in_picture() -> Mistake {
    let message = "a rig file with [plane] has no metres: give columns u and v, in pixels";
    Mistake::of_line(1, message.to_owned())
}

/// Returns the mistakes of the file at `path`.
fn mistakes_in(path: &Path, mistakes: Vec<Mistake>) -> FileMistakes {
    FileMistakes { path: PathBuf::from(path), mistakes }
}

/// Returns whether a text has lines of JSON.
fn is_json(text: &str) -> bool {
    text.trim_start_matches('\u{feff}').trim_start().starts_with('{')
}

/// Returns the places to stop at.
fn stops(places: &Places, rules: &MotionRules) -> Result<Vec<Waypoint>, Vec<Mistake>> {
    let wrong = |place: &Place| {
        let error = rules.target(place.position.into()).err()?;
        Some(misplaced_at(place.line, place.position.into(), error))
    };
    let mistakes: Vec<Mistake> = places.places.iter().filter_map(wrong).collect();
    let waypoint = |place: &Place| Waypoint {
        target: place.position.into(),
        dwell_s: place.dwell_s,
        tolerance_m: place.tolerance_m,
    };
    if mistakes.is_empty() {
        Ok(places.places.iter().map(waypoint).collect())
    } else {
        Err(mistakes)
    }
}

/// Returns a mistake for each place of a path that `rules` do not allow.
pub fn misplaced(path: &Path, places: &Places, rules: &MotionRules) -> FileMistakes {
    let wrong = |place: &Place| {
        let error = rules.check(place.position, Vector3::zeros()).err()?;
        Some(misplaced_at(place.line, place.position.into(), error))
    };
    mistakes_in(path, places.places.iter().filter_map(wrong).collect())
}

fn misplaced_at(line: usize, [x, y, z]: [f64; 3], error: MotionError) -> Mistake {
    Mistake::of_line(line, format!("[{x:.4}, {y:.4}, {z:.4}] m: {error}"))
}

/// Returns the targets of lines of JSON, with their times from the first one.
fn targets(text: &str, rules: &MotionRules) -> Result<Vec<FileTarget>, Vec<Mistake>> {
    let (mut targets, mut mistakes) = (Vec::<FileTarget>::new(), Vec::new());
    let mut first = None;
    let text = text.trim_start_matches('\u{feff}');
    for (number, text) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let mut mistake = |problem: String| mistakes.push(Mistake::of_line(number, problem));
        let line = match TargetLine::parse(text) {
            Ok(line) => line,
            Err(error) => {
                mistake(ErrorChain(&error).to_string());
                continue;
            }
        };
        let Some(t) = line.t else {
            mistake("`t` is missing: a file is read by its times".to_owned());
            continue;
        };
        let time_s = t - *first.get_or_insert(t);
        if targets.last().is_some_and(|before| time_s <= before.time_s) {
            mistake("`t` must grow from line to line".to_owned());
        } else if let Err(error) = rules.check(line.position(), Vector3::zeros()) {
            mistakes.push(misplaced_at(number, line.position().into(), error));
        } else {
            targets.push(FileTarget { time_s, line });
        }
    }
    if mistakes.is_empty() { Ok(targets) } else { Err(mistakes) }
}

#[cfg(test)]
mod tests;
