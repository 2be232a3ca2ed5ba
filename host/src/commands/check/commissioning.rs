//! `plumb check`: jogs each motor, watches the ball, and offers the corrected rig file.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use plumb_config::bounded_read::read_text;
use plumb_config::toml_file::MAX_BYTES;
use plumb_protocol::MOTORS;
use plumb_runtime::board_report::BoardReport;
use plumb_runtime::link::Link;
use plumb_runtime::observer::Observer;
use plumb_runtime::rig::Rig;
use plumb_runtime::wakeups::WakeupCheck;
use plumb_setup::commission::{Examination, Explanation, Report, corrected};
use plumb_setup::watch::WatchParts;
use serde_json::{Value, json};

use super::options::Args;
use super::words;
use crate::cli::choices::detector;
use crate::cli::exit::{Failure, failed};
use crate::cli::interrupt::{interrupt_flag, interrupted_before};
use crate::cli::old_file::{OldFile, ask};
use crate::cli::port::Port;
use crate::session::camera::{RunCamera, SimulatedRig, read_camera};
use crate::session::connection::RigBoard;

/// Result of the jogs.
pub(super) struct Jogged {
    /// Whether no fault was found.
    pub(super) is_right: bool,
    /// Line of JSON.
    pub(super) line: Value,
}

/// Jogs of a check that are prepared.
pub(super) type Jogs = Box<dyn FnOnce(&Args) -> Result<Jogged, Failure>>;

/// Prepares the jogs of the rig of `file`, if the user agrees or has agreed: connects to the board,
/// and opens the camera.
pub(super) fn prepare(args: &Args, file: PathBuf) -> Result<Jogs, Failure> {
    let rig = Rig::read(&file)?;
    if rig.motors.count() < MOTORS {
        return Err(failed(
            "the jogs of `plumb check` explain rigs of three motors; with two, jog each \
                           by `plumb jog` and look which way the ball goes",
        ));
    }
    if rig.camera.recording.is_some() {
        return Err(failed(
            "a recording does not follow the motors: the jogs need a live camera. `--file-only` \
             checks the files",
        ));
    }
    let (_, camera) = read_camera(&file, &rig)?;
    args.port.note(&file, &rig);
    let board = RigBoard { file: &file, rig: &rig, port: &args.port };
    if !args.yes {
        // A board that cannot be configured makes the question needless.
        board.check_state()?;
        if !ask(words::QUESTION)? {
            let no = "nothing has moved: the check goes on after a yes only";
            return Ok(Box::new(move |_| Err(failed(no))));
        }
    }
    let port = args.port.open(&rig)?;
    let interrupted = interrupt_flag(true)?;
    // An emulated board shares the computer, and needs no time of it.
    let wakeups = (!port.is_pseudo_terminal()).then(measure_wakeups);
    let led = port.led_port().cloned();
    let mut link = board.configured(port, false)?;
    let motors = BoardReport::from(&link.status()?).motors;
    let simulated = SimulatedRig { physics: args.physics, motors, led };
    let camera = RunCamera::open_beside_board(board, camera, None, simulated)?;
    Ok(Box::new(move |args| {
        camera.check_ball(&rig, &motors)?;
        let report = jog_and_look(args, &rig, camera, (link, &interrupted))?;
        words::tell_report(&report);
        let written = offer_correction((args, &file), &rig, &report)?;
        let line = line(&report, written, wakeups);
        Ok(Jogged { is_right: report.is_right(), line })
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
    (mut link, interrupted): (Link<Port>, &AtomicBool),
) -> Result<Report, Failure> {
    let RunCamera { mut source, camera, mut follower, .. } = camera;
    if interrupted.load(Ordering::Relaxed) {
        return Err(interrupted_before("check"));
    }
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(follower.as_mut().map(|follower| follower as &mut dyn Observer));
    let mut parts = WatchParts {
        source: &mut *source,
        detector: &mut *detector(args.detector, &camera),
        observers: &mut observers,
        progress: &mut |text| note!("{text}"),
        interrupted,
    };
    Ok(Examination::run(rig, &mut link, &mut parts)?)
}

/// Offers the rig file with the right directions. Returns whether it is written.
fn offer_correction(
    (args, path): (&Args, &Path),
    rig: &Rig,
    report: &Report,
) -> Result<bool, Failure> {
    let Some(reversed) = report.corrected_directions(rig.motors.reversed().steppable(false)) else {
        return Ok(false);
    };
    let text = read_text(path, MAX_BYTES)?;
    let new = corrected(&text, reversed).map_err(failed)?;
    OldFile { path, text: &text }.offer(&new, &format!("`reversed = {reversed:?}`"), args.yes)
}

/// Returns the result of the jogs in JSON: places and moves for outputs A, B, C at the far end of
/// the jog that pays out, and whether the rig file is `written`.
fn line(report: &Report, written: bool, wakeups: Option<WakeupCheck>) -> Value {
    let micrometres = |metres: f64| (metres * 1e6).round() / 1e3;
    let ball = [0, 1, 2].map(|axis| micrometres(report.ball[axis]) / 1e3);
    let mut line = json!({
        "right": report.is_right(),
        "ball_m": ball,
        "moved_mm": report.responses.map(|it| <[f64; 3]>::from(it.out.moved).map(micrometres)),
        "steps": report.responses.map(|it| it.out.steps),
        "faults": report.faults,
        "alternatives": report.alternatives.iter().map(Explanation::faults).collect::<Vec<_>>(),
        "yaw_deg": (report.yaw_deg * 10.0).round() / 10.0,
        "written": written,
    });
    if let Some(doubt) = report.doubt {
        line["doubt"] = doubt.to_string().into();
    }
    // An emulated board needs no time of the computer.
    if let Some(WakeupCheck { latest, .. }) = wakeups {
        line["latest_wakeup_ms"] = (latest.as_micros() as f64 / 1e3).into();
    }
    line
}
