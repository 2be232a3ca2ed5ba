//! `plumb replay`: detection and location on a recording.

use std::cell::RefCell;
use std::io::{IsTerminal, stdout};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Parser;
use plumb_cameras::camera_file;
use plumb_cameras::record::CAMERA_FILE;
use plumb_cameras::recording::{check_exists, check_kind, is_mcap, own_camera_file};
use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_config::bounded_read::ReadError;
use plumb_config::error_chain::ErrorChain;
use plumb_frame::driver::OpenedSource;
use plumb_frame::source::CameraSource;
use plumb_log::replay::{DebugFolder, Problem, ReplayOutcome, replay};
use plumb_vision::camera::Camera;
use plumb_vision::detect::DetectorKind;

use crate::cli::choices::detector;
use crate::cli::exit::{Exit, Failure, Work, failed};
use crate::cli::print;
use crate::cli::print::{ProgressLine, is_shown};
use crate::session::camera::other_depth_scale;
use crate::session::ros2::open_recording;

/// Detection and location on a recording (a TUM RGB-D folder, an .oni, .bag, .db3, .mcap or video
/// file): a CSV row a frame
#[derive(Parser)]
#[command(after_help = examples![
    "plumb replay recordings/one > ball.csv",
    "plumb replay one.oni --camera camera.toml --debug stages",
])]
pub(crate) struct Args {
    /// The folder, with rgb.txt and depth.txt, or the file
    recording: PathBuf,
    /// The camera file (TOML) [default: camera.toml in the recording's folder]
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Detector
    #[arg(long, value_enum, default_value = "ball")]
    detector: DetectorKind,
    /// Write an image of each of the detector's stages for each frame into this new folder
    #[arg(long, value_name = "DIR")]
    debug: Option<PathBuf>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    check_recording(&args.recording)?;
    let file = args.camera.clone().map_or_else(|| beside(&args.recording), Ok)?;
    let mut camera = camera_file::read(&file)?;
    if let Some(warning) = other_depth_scale(&args.recording, &file, &camera) {
        tell!("plumb: warning: {warning}. Leave out --camera");
    }
    let topics = Ros2CameraSettings::default();
    let opened = open_recording(&args.recording, &camera, &topics)?;
    let OpenedSource { mut source, intrinsics, notes, .. } = opened;
    for note in &notes {
        tell!("plumb: {note}");
    }
    camera.intrinsics = intrinsics;
    let debug = args.debug.as_deref().map(DebugFolder::create).transpose()?;
    Ok(Box::new(move || work(&args, &camera, &mut *source, debug.as_ref())))
}

/// Replays the recording `source` of `camera`.
fn work(
    args: &Args,
    camera: &Camera,
    source: &mut dyn CameraSource,
    debug: Option<&DebugFolder>,
) -> Result<Exit, Failure> {
    // Rows on the terminal are its progress.
    let line = RefCell::new(ProgressLine::shown_if(is_shown() && !stdout().is_terminal()));
    let mut detector = detector(args.detector, camera);
    let report = |problem: &Problem| {
        line.borrow_mut().clear();
        tell!("plumb: {}", ErrorChain(problem));
    };
    let progress = |outcome: &ReplayOutcome| {
        let ReplayOutcome { frames, detected, .. } = outcome;
        let text = format_args!("frame {frames}, {detected} with a ball");
        line.borrow_mut().show(text, Instant::now());
    };
    let rows = print::Results;
    let result = replay(source, camera, &mut *detector, rows, debug, report, progress);
    line.borrow_mut().clear();
    let outcome = match result {
        // Whoever reads the rows has enough of them.
        Err(error) if error.is_closed_pipe() => return Ok(Exit::Done),
        result => result?,
    };
    note!(
        "{} frames: {} with a ball, {} of them located; {} broken, {} without depth",
        outcome.frames,
        outcome.detected,
        outcome.located,
        outcome.broken,
        outcome.without_depth
    );
    let line = serde_json::json!({
        "frames": outcome.frames,
        "detected": outcome.detected,
        "located": outcome.located,
        "broken": outcome.broken,
        "without_depth": outcome.without_depth,
    });
    print::json(args.json, line)?;
    Ok(Exit::done_if(outcome.broken == 0))
}

/// Checks that a recording exists, and is not the folder of a run.
fn check_recording(recording: &Path) -> Result<(), Failure> {
    let name = recording.display();
    let has = |file: &str| recording.join(file).exists();
    check_exists(recording)?;
    if recording.is_dir() {
        // A folder that may not be looked into has no file.
        let unreadable = |error| ReadError::Io { path: recording.to_owned(), error };
        recording.join(CAMERA_FILE).try_exists().map_err(unreadable)?;
    }
    if has("run.csv") && !has("rgb.txt") {
        return Err(failed(format!(
            "{name}: this is a run's folder, and no recording: `plumb run --record FOLDER` records"
        )));
    }
    Ok(())
}

/// Returns the path of the camera file in the folder of a recording.
///
/// # Errors
/// Where the camera file does not exist, or `recording` is none.
fn beside(recording: &Path) -> Result<PathBuf, Failure> {
    let file = own_camera_file(recording);
    if file.exists() {
        return Ok(file);
    }
    check_kind(recording)?;
    let without_depth = match is_mcap(recording) {
        true => {
            "; for a file of `--mcap`, which has no depth, a copy of the run's with `depth_scale = \
             \"none\"` in it"
        }
        false => "",
    };
    Err(failed(format!(
        "{}: this recording has no camera file; name one with --camera CAMERA.toml{without_depth}",
        file.display()
    )))
}
