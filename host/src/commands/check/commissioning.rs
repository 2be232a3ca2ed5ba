//! `plumb check`: jogs each motor, watches the ball, and offers the corrected rig file.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use plumb_cameras::settings::SourceName;
use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::MAX_BYTES;
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::link::{Link, Serial};
use plumb_runtime::observer::Observer;
use plumb_runtime::rig::Rig;
use plumb_runtime::wakeups::WakeupCheck;
use plumb_setup::commission::{
    Examination, ExaminationParts, Explanation, Fault, Report, corrected,
};
use serde::Serialize;

use super::super::connection::{check_state, configured, without_simulation};
use super::super::interrupt::{interrupt_flag, interrupted_before};
use super::super::old_file::{OldFile, ask};
use super::super::print::{note, tell};
use super::super::run_camera::{RunCamera, read_camera};
use super::super::{Failure, failed};
use super::{Args, words};

/// Result of the jogs.
#[derive(Serialize)]
pub(super) struct RigLine {
    /// Whether no fault was found.
    pub(super) right: bool,
    /// Place of the ball before the first jog, metres.
    ball_m: [f64; 3],
    /// Displacement of the ball for outputs A, B, C at the far end of the jog that pays out,
    /// millimetres.
    moved_mm: [[f64; 3]; 3],
    /// Its distance, full steps.
    steps: [f64; 3],
    faults: Vec<Fault>,
    /// Doubt about the measured positions; left out where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    doubt: Option<String>,
    /// Faults that would look the same.
    alternatives: Vec<Vec<Fault>>,
    /// Turn of the camera's pose about the vertical beyond the faults, degrees.
    yaw_deg: f64,
    /// Whether the rig file was corrected.
    written: bool,
    /// Greatest lateness of the program's wake-ups before the jogs, milliseconds; left out with an
    /// emulated board.
    #[serde(skip_serializing_if = "Option::is_none")]
    latest_wakeup_ms: Option<f64>,
}

/// Jogs of a check that are prepared.
pub(super) type Jogs = Box<dyn FnOnce(&Args) -> Result<RigLine, Failure>>;

/// Prepares the jogs of the rig of `file`, if the user agrees or has agreed: connects to the board,
/// and opens the camera.
pub(super) fn prepare(args: &Args, file: PathBuf) -> Result<Jogs, Failure> {
    let rig = Rig::read(&file)?;
    if rig.camera.recording.is_some() {
        return Err(failed(
            "a recording does not follow the motors: the jogs need a live camera. `--file-only` \
             checks the files",
        ));
    }
    let (_, camera) = read_camera(&file, &rig)?;
    args.port.note(&file, &rig);
    if !args.yes {
        // A board that cannot be configured makes the question needless.
        check_state(&file, &rig, &args.port)?;
        if !ask(words::QUESTION)? {
            let no = "nothing has moved: the check goes on after a yes only";
            return Ok(Box::new(move |_| Err(failed(no))));
        }
    }
    let port = args.port.open(&rig)?;
    let interrupted = interrupt_flag(true)?;
    // An emulated board shares the computer, and needs no time of it.
    let wakeups = (!port.is_pseudo_terminal()).then(measure_wakeups);
    let mut link = configured(&file, &rig, &args.port, port, false)?;
    let motors = BoardReport::from(&link.status()?).motors;
    let chosen = rig.camera.source(rig.simulation.is_some());
    let chosen = chosen.map_err(|error| failed(format!("{}: {error}", file.display())))?;
    let camera = match chosen {
        SourceName::Simulated => RunCamera::simulated(&rig, camera, args.physics, motors)?,
        _ => {
            let advice = without_simulation(&file, &rig, &args.port);
            RunCamera::open(&rig, camera, None, advice.as_deref())?
        }
    };
    Ok(Box::new(move |args| {
        camera.check_ball(&rig, motors)?;
        let report = jog_and_look(args, &rig, camera, (link, &interrupted))?;
        words::tell_report(&report);
        let written = offer_correction((args, &file), &rig, &report)?;
        Ok(RigLine::new(&report, written, wakeups))
    }))
}

/// Measures how late the computer wakes this program, and prints it.
fn measure_wakeups() -> WakeupCheck {
    let wakeups = WakeupCheck::measure();
    tell!("{wakeups}");
    wakeups
}

/// Jogs the motors and watches the ball.
fn jog_and_look(
    args: &Args,
    rig: &Rig,
    camera: RunCamera,
    (link, interrupted): (Link<Serial>, &AtomicBool),
) -> Result<Report, Failure> {
    let RunCamera { mut source, camera, mut follower, .. } = camera;
    if interrupted.load(Ordering::Relaxed) {
        return Err(interrupted_before("check"));
    }
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(follower.as_mut().map(|follower| follower as &mut dyn Observer));
    let mut parts = ExaminationParts {
        source: &mut *source,
        detector: &mut *args.detector.detector(&camera),
        observers: &mut observers,
        progress: &mut |text| note!("{text}"),
        interrupted,
    };
    Ok(Examination::run(rig, link, &mut parts)?)
}

/// Offers the rig file with the right directions. Returns whether it is written.
fn offer_correction(
    (args, path): (&Args, &Path),
    rig: &Rig,
    report: &Report,
) -> Result<bool, Failure> {
    let Some(reversed) = report.corrected_directions(rig.motors.reversed) else {
        return Ok(false);
    };
    let text = read_text(path, MAX_BYTES)?;
    let new = corrected(&text, reversed).map_err(failed)?;
    OldFile { path, text: &text }.offer(&new, &format!("`reversed = {reversed:?}`"), args.yes)
}

impl RigLine {
    fn new(report: &Report, written: bool, wakeups: Option<WakeupCheck>) -> Self {
        let micrometres = |metres: f64| (metres * 1e6).round() / 1e3;
        Self {
            right: report.is_right(),
            ball_m: [0, 1, 2].map(|axis| micrometres(report.ball[axis]) / 1e3),
            moved_mm: report.responses.map(|it| <[f64; 3]>::from(it.out.moved).map(micrometres)),
            steps: report.responses.map(|it| it.out.steps),
            faults: report.faults.clone(),
            doubt: report.doubt.map(|doubt| doubt.to_string()),
            alternatives: report.alternatives.iter().map(Explanation::faults).collect(),
            yaw_deg: (report.yaw_deg * 10.0).round() / 10.0,
            written,
            latest_wakeup_ms: wakeups.map(|it| it.latest.as_micros() as f64 / 1e3),
        }
    }
}
