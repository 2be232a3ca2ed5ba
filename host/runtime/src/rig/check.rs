//! Check of a rig file and its camera file without a board: every mistake at once, as a finding.

mod board;
mod camera;
pub(super) mod size;
mod targets;
#[cfg(test)]
mod tests;
mod view;
pub(super) mod wiring;

use std::fmt;
use std::path::{Path, PathBuf};

use plumb_cameras::camera_file;
use plumb_cameras::settings::SourceName;
use plumb_config::bounded_read::read_text;
use plumb_config::error_chain::ErrorChain;
use plumb_config::mistake::{Kind, Mistake};
use plumb_config::reference::{Key, keys};
use plumb_config::toml_file::{MAX_BYTES, diagnose, place};
use plumb_frame::camera::Camera;
use plumb_frame::source::BoxedError;
use plumb_protocol::message::Refusal;
use serde::Serialize;

use super::quantity::Conversion;
use super::{REFERENCE, Rig, Simulation};
use crate::link::other_port;

pub use self::board::BoardCheck;

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

/// What follows a mistake of syntax.
const HIDDEN: &str = "; other mistakes show when the syntax is right";

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
    let wrong: Vec<String> = diagnosis.mistakes.into_iter().map(|mistake| mistake.key).collect();
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
    let knows_size = !tables.iter().any(|table| is_below(table, &wrong));
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

/// Returns what is allowed in place of a mistake in a rig file.
pub(super) fn allowed(path: &Path, text: &str, mistake: &Mistake) -> String {
    Document::new(path, text, REFERENCE).mistake(mistake).allowed
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

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// A run with this file is refused.
    Error,
    /// A run with this file starts, but the rig is badly protected or moves badly.
    Warning,
}

/// Finding of a check: a key, its value, what is wrong, and what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Severity.
    pub severity: Severity,
    /// The file.
    pub file: PathBuf,
    /// Number of the line, from 1; `None` for a key that the file does not have.
    pub line: Option<usize>,
    /// The keys with their tables and values, as they are written; none for an error of syntax.
    pub values: Vec<(String, String)>,
    /// What is wrong.
    pub problem: String,
    /// What is allowed, and an example; empty where the problem says so.
    pub allowed: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(match self.severity {
            Severity::Error => ": error: ",
            Severity::Warning => ": warning: ",
        })?;
        f.write_str(&self.explanation())
    }
}

impl Finding {
    /// Returns the keys with their values, what is wrong with them, and what is allowed.
    fn explanation(&self) -> String {
        let values = self.values.iter().map(|(key, value)| match value.as_str() {
            "" => format!("`{key}`"),
            _ => format!("`{key} = {value}`"),
        });
        let values = values.collect::<Vec<_>>().join(", ");
        let space = if values.is_empty() { "" } else { " " };
        let allowed = match self.allowed.as_str() {
            "" => String::new(),
            allowed => format!("; allowed: {allowed}"),
        };
        format!("{values}{space}{}{allowed}", self.problem)
    }
}

/// File under check, with its reference page.
struct Document<'a> {
    path: &'a Path,
    text: &'a str,
    keys: Vec<Key>,
}

impl<'a> Document<'a> {
    /// Returns the file at `path` with this text. `page` is the reference page of its format.
    fn new(path: &'a Path, text: &'a str, page: &str) -> Self {
        Self { path, text, keys: keys(page) }
    }

    /// Returns a finding about `names`, the first of which gives the line.
    fn finding(&self, severity: Severity, names: &[&str], problem: impl Into<String>) -> Finding {
        let places: Vec<_> = names.iter().map(|name| place(self.text, name)).collect();
        let values = names.iter().zip(&places).map(|(name, place)| {
            let value = place.as_ref().map(|place| place.value.clone());
            ((*name).to_owned(), value.unwrap_or_else(|| self.default_of(name)))
        });
        Finding {
            severity,
            file: self.path.to_owned(),
            line: places.iter().flatten().map(|place| place.line).next(),
            values: values.collect(),
            problem: problem.into(),
            allowed: String::new(),
        }
    }

    /// Returns the error of values out of range, with their ranges.
    fn out_of_range(&self, names: &[&str], problem: impl Into<String>) -> Finding {
        let allowed = names.iter().filter_map(|name| self.allowed(name));
        let allowed = allowed.collect::<Vec<_>>().join("; ");
        Finding { allowed, ..self.finding(Severity::Error, names, problem) }
    }

    /// Returns the errors of all mistakes in the text. The last one says where others are hidden.
    fn mistakes(&self, mistakes: &[Mistake]) -> Vec<Finding> {
        let mut findings: Vec<Finding> = mistakes.iter().map(|it| self.mistake(it)).collect();
        let hides_others = mistakes.iter().any(|mistake| mistake.kind == Kind::Syntax);
        if let Some(last) = findings.last_mut().filter(|_| hides_others) {
            last.problem.push_str(HIDDEN);
        }
        findings
    }

    /// Returns the error of a mistake in the text.
    fn mistake(&self, mistake: &Mistake) -> Finding {
        let Mistake { line, key, value, kind, .. } = mistake;
        let is_of_table = *kind == Kind::Wrong && value.is_empty();
        let allowed = self.allowed(key).filter(|_| *kind != Kind::Unknown && !is_of_table);
        Finding {
            severity: Severity::Error,
            file: self.path.to_owned(),
            line: Some(*line),
            values: (!key.is_empty()).then(|| (key.clone(), value.clone())).into_iter().collect(),
            problem: mistake.problem(),
            allowed: allowed.unwrap_or_default(),
        }
    }

    /// Returns the description of a key in the reference page; `None` for an unknown key.
    fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// Returns the range of a key with an example; `None` for an unknown key.
    fn allowed(&self, name: &str) -> Option<String> {
        let Some(key) = self.key(name) else {
            let table = format!("{name}.");
            let is_table = self.keys.iter().any(|key| key.name.starts_with(&table));
            return is_table.then(|| format!("a table, [{name}] with its keys below it"));
        };
        let unit = match key.unit.as_str() {
            "" | "1" => String::new(),
            unit => format!(" ({unit})"),
        };
        let range = if key.range.is_empty() { &key.meaning } else { &key.range };
        let example = match key.value.as_str() {
            "" => String::new(),
            value => format!(", for example {value}"),
        };
        Some(format!("{range}{unit}{example}"))
    }

    /// Returns the default of a key that the file does not have.
    fn default_of(&self, name: &str) -> String {
        self.key(name).map(|key| key.value.clone()).unwrap_or_default()
    }
}
