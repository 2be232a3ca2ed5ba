//! `plumb check` refuses each rig file and camera file that a run refuses, and no other.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::ops::Range;
use std::path::Path;

use plumb_cameras::camera_file;
use plumb_config::bounded_read::read_text;
use plumb_config::error_chain::ErrorChain;
use plumb_config::toml_file::MAX_BYTES;
use plumb_emulator::EmulatedBoard;
use plumb_frame::source::BoxedError;
use plumb_runtime::rig::Rig;
use plumb_runtime::rig::check::{Severity, SimulationMistake, check};
use plumb_runtime::run::Run;
use plumb_sim::simulated::{VirtualBoard, check_simulation};

/// The paper's rig file, with keys that have defaults.
const RIG: &str = concat!(
    include_str!("../../../host/rigs/paper.toml"),
    "\n[following]\nturn = 150.0\nmovement = 0.02\n",
    "\n[progress]\nmargin = 0.005\ntime = 10.0\n",
    "\n[jog]\nmax_rate = 50.0\nmax_distance = 200.0\n",
    "\n[path]\nmax_speed = 0.1\nmax_acceleration = 0.2\nmax_jerk = 1.0\ndeviation = 0.04\n",
    "\n[law.taut]\nmean = 0.4\ndelay = 0.045\n",
);

/// Values at which each number of the files is tried.
const EXTREMES: [&str; 16] = [
    "0.0", "-0.0", "-1.0", "0.5", "1.0", "1e-300", "1e-9", "-1e-9", "1e-3", "1e3", "1e6", "1e9",
    "-1e9", "1e300", "nan", "inf",
];

/// Returns the places of the numbers of a file, as ranges of bytes.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let is_part = |c: char| c.is_ascii_digit() || ".-e".contains(c);
    let (mut found, mut at) = (Vec::new(), 0);
    for line in text.split_inclusive('\n') {
        let code = line.split('#').next().unwrap_or_default();
        if let Some((key, value)) = code.split_once('=').filter(|(_, v)| !v.contains('"')) {
            let mut from = key.len() + 1;
            while let Some(digit) = code[from..].find(|c: char| c.is_ascii_digit()) {
                let begin = code[..from + digit].rfind(|c| !is_part(c)).map_or(0, |k| k + 1);
                let length = code[begin..].find(|c| !is_part(c)).unwrap_or(code.len() - begin);
                found.push(at + begin..at + begin + length);
                from = begin + length;
            }
            assert!(value.len() < line.len());
        }
        at += line.len();
    }
    found
}

/// Returns why a run with a simulated rig refuses the files, before it looks for the ball.
fn refusal(path: &Path) -> Result<(), BoxedError> {
    let rig = Rig::read(path)?;
    let camera = camera_file::parse(&rig.camera.file, &read_text(&rig.camera.file, MAX_BYTES)?)?;
    Run::connect(&rig, VirtualBoard::paper()?.transport())?;
    let simulation = rig.simulation.as_ref().unwrap();
    Ok(check_simulation(&rig, simulation, &camera)?)
}

/// Returns the errors that `plumb check` finds.
fn errors(path: &Path) -> Vec<String> {
    let findings = check(path, &EmulatedBoard::refusals, &|rig, simulation, camera| {
        check_simulation(rig, simulation, camera).map_err(SimulationMistake::from)
    });
    let errors = findings.iter().filter(|finding| finding.severity == Severity::Error);
    errors.map(ToString::to_string).collect()
}

/// Tries each number of `text`, the file `name`, at the extremes. Returns the number of files and
/// those about which the two differ.
fn differences(folder: &Path, name: &str, text: &str) -> (usize, Vec<String>) {
    let (mut tried, mut differences) = (0, Vec::new());
    for range in numbers(text) {
        for value in EXTREMES {
            let mut changed = text.to_owned();
            changed.replace_range(range.clone(), value);
            fs::write(folder.join(name), &changed).unwrap();
            let (rig, line) = (folder.join("rig.toml"), text[..range.start].lines().count());
            let (errors, refusal) = (errors(&rig), refusal(&rig));
            tried += 1;
            if errors.is_empty() != refusal.is_ok() {
                let run = refusal.map_err(|error| ErrorChain(&*error).to_string());
                differences.push(format!("{name}:{line}, {value}: check {errors:?}, run {run:?}"));
            }
        }
    }
    fs::write(folder.join(name), text).unwrap();
    (tried, differences)
}

#[test]
fn check_and_run_refuse_the_same_files() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    fs::write(folder.path().join("camera.toml"), camera_file::PAPER).unwrap();
    assert_eq!(errors(&folder.path().join("rig.toml")), [""; 0]);
    for (name, text, least) in [("rig.toml", RIG, 700), ("camera.toml", camera_file::PAPER, 200)] {
        let (tried, differences) = differences(folder.path(), name, text);
        assert!(tried >= least, "{name}: {tried} files");
        let list = differences.join("\n");
        assert!(differences.is_empty(), "{} of {tried} differ:\n{list}", differences.len());
    }
}
