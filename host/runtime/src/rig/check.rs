//! Check of a rig file and its camera file without a board: every mistake at once, as a finding.

mod board;
mod camera;
mod size;
mod targets;
#[cfg(test)]
mod tests;
mod view;
mod wiring;

use std::path::{Path, PathBuf};

use plumb_cameras::camera_file;
use plumb_cameras::settings::SourceName;
use plumb_config::bounded_read::read_text;
use plumb_config::error_chain::ErrorChain;
use plumb_config::toml_file::{MAX_BYTES, diagnose};
use plumb_frame::camera::Camera;
use plumb_frame::source::BoxedError;
use plumb_protocol::message::Refusal;

use super::document::Document;
use super::quantity::Conversion;
use super::{REFERENCE, Rig, Simulation, plane_mistakes};
use crate::link::other_port;

pub use self::board::BoardCheck;
pub use super::document::{Finding, Severity};

/// Check of the simulated rig of a rig file, with the camera of its camera file.
pub type SimulationCheck<'a> =
    &'a dyn Fn(&Rig, &Simulation, &Camera) -> Result<(), SimulationMistake>;

/// Reason that a simulated rig cannot be simulated.
#[derive(Debug)]
pub struct SimulationMistake {
    /// The key of the rig file that is wrong; the whole table `simulation` where it is not known.
    pub key: &'static str,
    /// The reason.
    pub error: BoxedError,
}

/// Values with which the check goes on where the file has a mistake.
const PLACEHOLDERS: &str = include_str!("check/placeholders.toml");

/// Checks the rig file at `path`, and the camera file that it names.
///
/// `board` checks the limits of the board, and `simulation` the simulated rig of files without
/// errors. What the camera would see of the workspace is checked where both files have no error.
/// Returns all findings, errors and warnings, by file; none where the files are right.
pub fn check(path: &Path, board: BoardCheck<'_>, simulation: SimulationCheck<'_>) -> Vec<Finding> {
    let text = match read_text(path, MAX_BYTES) {
        Ok(text) => text,
        Err(error) => return vec![of_file(path, ErrorChain(&error).to_string())],
    };
    if camera_file::is_camera_file(&text) {
        return vec![of_file(path, "this is a camera file; give the rig file".to_owned())];
    }
    let (mut findings, camera) = check_text(path, &text, board);
    if let Some(file) = camera {
        findings.extend(camera::file(&file, &Document::new(path, &text, REFERENCE)));
    }
    if findings.iter().all(|finding| finding.severity == Severity::Warning) {
        findings.extend(together(path, &text, simulation));
    }
    findings
}

/// Returns the errors of the targets of `rig`, which the file at `path` with this `text` describes:
/// none at all, or one that the rig does not allow. The file is not read.
pub fn wrong_targets(path: &Path, text: &str, rig: &Rig) -> Vec<Finding> {
    targets::findings(&Document::new(path, text, REFERENCE), rig)
}

/// Returns what is not plausible about `camera`, which a camera file with this `text` describes, as
/// the camera of `rig`: its lens, and what it would see of the workspace. The file is not read.
pub fn implausible(rig: &Rig, text: &str, camera: &Camera) -> Vec<Finding> {
    view::findings(&Document::new(&rig.camera.file, text, camera_file::REFERENCE), camera, rig)
}

/// Checks a rig file and its camera file, both without errors, together: what the camera would see,
/// and the simulated rig.
fn together(path: &Path, text: &str, simulation: SimulationCheck<'_>) -> Vec<Finding> {
    let Ok(rig) = Rig::read(path) else { return Vec::new() };
    let file = &rig.camera.file;
    let Ok(camera_text) = read_text(file, MAX_BYTES) else { return Vec::new() };
    let Ok(camera) = camera_file::parse(file, &camera_text) else { return Vec::new() };
    let mut findings = implausible(&rig, &camera_text, &camera);
    let document = Document::new(file, &camera_text, camera_file::REFERENCE);
    findings.extend(camera::other_pictures(&document, &rig, &camera));
    findings.extend(simulated(&Document::new(path, text, REFERENCE), &rig, &camera, simulation));
    findings
}

/// Checks the simulated rig of a file, where its camera renders that rig.
fn simulated(
    document: &Document<'_>,
    rig: &Rig,
    camera: &Camera,
    check: SimulationCheck<'_>,
) -> Option<Finding> {
    let simulation = rig.simulation.as_ref()?;
    if rig.camera.source(true).ok()? != SourceName::Simulated {
        return None;
    }
    let SimulationMistake { key, error } = check(rig, simulation, camera).err()?;
    let problem = format!("cannot be simulated: {}", ErrorChain(&*error));
    Some(document.finding(Severity::Error, &[key], problem))
}

/// Checks the text of the rig file at `path`. Returns all findings, and the camera file that it
/// names.
pub(crate) fn check_text(
    path: &Path,
    text: &str,
    board: BoardCheck<'_>,
) -> (Vec<Finding>, Option<PathBuf>) {
    let document = Document::new(path, text, REFERENCE);
    let diagnosis = diagnose::<Rig>(text, PLACEHOLDERS);
    let mut findings = document.mistakes(&diagnosis.mistakes);
    let Some(mut rig) = diagnosis.contents else { return (findings, None) };
    let about_plane = plane_mistakes(text, &rig);
    findings.extend(document.mistakes(&about_plane));
    let mistakes = diagnosis.mistakes.into_iter().chain(about_plane);
    let wrong: Vec<String> = mistakes.map(|mistake| mistake.key).collect();
    rig.widen();
    let mut more = values(&document, &rig, board);
    if let Some(folder) = path.parent() {
        rig.camera.relative_to(folder);
    }
    // Whether the source is named depends on each of these keys.
    let source = ["camera.source", "camera.recording", "camera.stream"];
    if !source.iter().any(|key| is_below(key, &wrong)) {
        more.extend(camera::source(&document, &rig.camera, rig.simulation.is_some()));
    }
    // A size or a workspace with a placeholder in it tells nothing about the other tables.
    let tables = ["size", "simulation", "workspace"];
    let knows_size = rig.plane.is_none() && !tables.iter().any(|table| is_below(table, &wrong));
    if knows_size && more.iter().all(|finding| finding.severity == Severity::Warning) {
        more.extend(size::findings(&document, &rig));
    }
    // A value that was replaced by a placeholder has its finding.
    more.retain(|finding| !finding.values.iter().any(|(key, _)| is_below(key, &wrong)));
    findings.extend(more);
    findings.sort_by_key(|finding| finding.line.unwrap_or(usize::MAX));
    let camera = (!is_below("camera.file", &wrong)).then_some(rig.camera.file);
    (findings, camera)
}

/// Returns whether `key` is one of `wrong`, or in a table of them, or has one of them in it.
fn is_below(key: &str, wrong: &[String]) -> bool {
    let within = |inner: &str, outer: &str| {
        inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    wrong.iter().any(|wrong| within(key, wrong) || within(wrong, key))
}

/// Returns the errors of values that the board refuses.
fn values(document: &Document<'_>, rig: &Rig, board: BoardCheck<'_>) -> Vec<Finding> {
    let mut conversion = Conversion::default();
    let (wiring, config) = (rig.convert_wiring(&mut conversion), rig.convert(&mut conversion));
    let mut findings = Vec::new();
    let mut reported = Vec::new();
    for error in conversion.into_errors() {
        reported.push(error.key.to_owned());
        let current = board::current(document, rig, error.key);
        findings.push(current.unwrap_or_else(|| document.out_of_range(&[error.key], error.why)));
    }
    let no_place = targets::no_place(document, rig);
    let keys = no_place.iter().flat_map(|finding| &finding.values);
    reported.extend(keys.map(|(key, _)| key.clone()));
    let mut refusals = board(&wiring, &config);
    refusals.dedup();
    for refusal in refusals {
        match refusal {
            Refusal::Config(field) => {
                for finding in board::findings(document, field, rig, board) {
                    let keys = || finding.values.iter().map(|(key, _)| key);
                    if !keys().any(|key| is_below(key, &reported)) {
                        reported.extend(keys().cloned());
                        findings.push(finding);
                    }
                }
            }
            Refusal::Wiring(error) => findings.push(wiring::finding(document, rig, &wiring, error)),
            other => findings.push(document.finding(
                Severity::Error,
                &["board.kind"],
                format!("is refused: {other}"),
            )),
        }
    }
    findings.extend(other_port(&rig.board.port).map(|instead| {
        document.finding(Severity::Warning, &["board.port"], format!("is no path: {instead}"))
    }));
    findings.extend(wiring::silent_drivers(document, &wiring));
    findings.extend(wiring::strapped(document, rig));
    findings.extend(targets::findings(document, rig));
    if rig.wrong_targets().is_empty() {
        findings.extend(targets::at_border(document, rig));
    }
    findings
}

/// Returns the error of a whole file.
fn of_file(path: &Path, problem: String) -> Finding {
    Finding {
        severity: Severity::Error,
        file: path.to_owned(),
        line: None,
        values: Vec::new(),
        problem,
        allowed: String::new(),
    }
}
