//! `plumb run` and `plumb goto`: a board, a camera, targets.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use plumb_cameras::bounded_read::read_text;
use plumb_cameras::camera_file;
use plumb_cameras::record::Overflow;
use plumb_cameras::source::tee::Tee;
use plumb_cameras::toml_file::MAX_BYTES;
use plumb_runtime::drive::Follow;
use plumb_runtime::link::Serial;
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::session::{Session, Summary};

use super::interrupt::interrupt_flag;
use super::options::RunOptions;
use super::run_camera::{RunCamera, record_folder, recorded};
use super::show::{Progress, conclude};
use super::{Failure, OrFail, law, numbers, print};

/// Drive the ball through the targets of a rig file
///
/// The camera is the one that the rig file names: through OpenNI2, or a recording. It is simulated
/// where the rig file has a [simulation] table and names none: the board, real or emulated, is then
/// tried without a rig, and what it says of its motors moves a simulated one.
#[derive(Parser)]
pub(crate) struct RunArgs {
    /// The rig file (TOML, SI units)
    rig: PathBuf,
    #[command(flatten)]
    options: Common,
}

/// Drive the ball to one target, metres in the rig frame
#[derive(Parser)]
#[command(allow_negative_numbers = true)]
pub(crate) struct GotoArgs {
    /// Along the side from motor C to motors A and B
    #[arg(value_parser = numbers::finite)]
    x: f64,
    /// Along the line from motor B to motor A
    #[arg(value_parser = numbers::finite)]
    y: f64,
    /// Upwards
    #[arg(value_parser = numbers::finite)]
    z: f64,
    /// The rig file (TOML, SI units)
    #[arg(long)]
    rig: PathBuf,
    #[command(flatten)]
    options: Common,
}

#[derive(Parser)]
struct Common {
    /// Serial port of the board [default: the rig file's]
    #[arg(long)]
    port: Option<String>,
    /// Control law, with its usual parameters: interval, sign, adaptive or taut [default: the rig
    /// file's]
    #[arg(long, value_parser = law)]
    law: Option<LawSettings>,
    #[command(flatten)]
    run: RunOptions,
}

pub(crate) fn run(args: RunArgs) -> Result<ExitCode, Failure> {
    let rig = Rig::read(&args.rig).or_bad_input()?;
    drive(&args.rig, rig, &args.options)
}

pub(crate) fn goto(args: GotoArgs) -> Result<ExitCode, Failure> {
    let mut rig = Rig::read(&args.rig).or_bad_input()?;
    rig.set_target([args.x, args.y, args.z]).or_bad_input()?;
    drive(&args.rig, rig, &args.options)
}

fn drive(file: &Path, mut rig: Rig, options: &Common) -> Result<ExitCode, Failure> {
    if let Some(law) = &options.law {
        rig.law = law.clone();
    }
    let text = read_text(&rig.camera.file, MAX_BYTES).or_bad_input()?;
    let camera = camera_file::parse(&rig.camera.file, &text).or_bad_input()?;
    let chosen = rig.camera.source(rig.simulation.is_some());
    let chosen = chosen.map_err(|error| format!("{}: {error}", file.display())).or_bad_input()?;
    let port = options.port.as_ref().unwrap_or(&rig.board.port);
    let transport = Serial::open(port, rig.board.baud).or_bad_input()?;
    let folder = record_folder(options.run.record.as_deref())?;
    let oni = folder.as_ref().map(|folder| folder.oni());
    let RunCamera { source, camera, follower } =
        RunCamera::open(chosen, &rig, camera, options.run.physics, oni)?;
    let recorder =
        folder.map(|folder| folder.begin(&text, &camera.intrinsics, Overflow::Drop)).transpose();
    let mut source = Tee::new(source, recorder.or_bad_input()?);

    let interrupted = interrupt_flag()?;
    let progress = Progress::new();
    let mut detector = options.run.detector.detector(&camera);
    let mut follow = follower.map(|mut follower| move |motors| Ok(follower.board_moved(motors)?));
    let session = Session {
        rig: &rig,
        detector: &mut *detector,
        place: options.run.place("run"),
        timeout: options.run.timeout,
        interrupted: &interrupted,
        progress: &mut |row| progress.show(row),
        follow: follow.as_mut().map(|follow| follow as Follow<'_>),
    };
    let result = session.run(&mut source, transport);
    progress.done();
    let recording = recorded(source);
    let json = |summary: &Summary| -> Result<(), Failure> {
        if options.run.json {
            print::result(serde_json::to_string(summary).or_failed()?)?;
        }
        Ok(())
    };
    conclude(result, recording, json)
}
