//! `plumb run` and `plumb goto`: a board, a camera, targets.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use plumb_cameras::bounded_read::read_text;
use plumb_cameras::camera_file;
use plumb_cameras::record::Overflow;
use plumb_cameras::settings::SourceName;
use plumb_cameras::toml_file::MAX_BYTES;
use plumb_runtime::link::Serial;
use plumb_runtime::observer::Observer;
use plumb_runtime::rig::{LawSettings, Rig};
use plumb_runtime::run::{Run, RunParts};
use plumb_runtime::run_log::{FigureSettings, RunLog};

use super::interrupt::interrupt_flag;
use super::options::RunOptions;
use super::outputs::Outputs;
use super::page::OperatedPage;
use super::run_camera::{RunCamera, record_folder};
use super::{Failure, Physics, bad_input, law, numbers, print};

/// Drive the ball through the targets of a rig file
///
/// The camera is the one that the rig file names: through OpenNI2, or a recording. It is simulated
/// where the rig file has a [simulation] table and names none: the board, real or emulated, is then
/// tried without a rig, and its motor positions move a simulated one.
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
    /// Physics of the simulated rig, where the camera is simulated [default: quasi-static]
    #[arg(long, value_enum)]
    physics: Option<Physics>,
    #[command(flatten)]
    run: RunOptions,
}

pub(crate) fn run(args: RunArgs) -> Result<ExitCode, Failure> {
    let rig = Rig::read(&args.rig)?;
    drive(&args.rig, rig, &args.options)
}

pub(crate) fn goto(args: GotoArgs) -> Result<ExitCode, Failure> {
    let mut rig = Rig::read(&args.rig)?;
    rig.set_targets(&[[args.x, args.y, args.z]])?;
    drive(&args.rig, rig, &args.options)
}

fn drive(file: &Path, mut rig: Rig, options: &Common) -> Result<ExitCode, Failure> {
    if let Some(law) = &options.law {
        rig.law = law.clone();
    }
    let text = read_text(&rig.camera.file, MAX_BYTES)?;
    let camera = camera_file::parse(&rig.camera.file, &text)?;
    let chosen = rig.camera.source(rig.simulation.is_some());
    let chosen = chosen.map_err(|error| bad_input(format!("{}: {error}", file.display())))?;
    if options.physics.is_some() && chosen != SourceName::Simulated {
        let why = "--physics is of a simulated rig, but the camera of this rig file is real";
        return Err(bad_input(format!("{}: {why}", file.display())));
    }
    let port = options.port.as_ref().unwrap_or(&rig.board.port);
    let transport = Serial::open(port, rig.board.baud)?;
    let folder = record_folder(options.run.record.as_deref())?;
    let oni = folder.as_ref().map(|folder| folder.oni());
    let RunCamera { mut source, camera, mut follower } = RunCamera::open(
        chosen,
        &rig,
        camera,
        options.physics.unwrap_or(Physics::QuasiStatic),
        oni,
    )?;
    let recorder =
        folder.map(|folder| folder.begin(&text, &camera.intrinsics, Overflow::Drop)).transpose()?;

    let interrupted = interrupt_flag()?;
    let OperatedPage { mut page, operator } = options.run.page.start(&rig)?;
    let run = Run::connect(&rig, transport)?;
    let log = RunLog::create(&options.run.output_dir("run"), FigureSettings::of(&rig));
    let mut outputs = Outputs::start(log?, recorder, Overflow::Drop)?;
    let mut observers: Vec<&mut dyn Observer> = vec![&mut outputs];
    observers.extend(follower.as_mut().map(|follower| follower as &mut dyn Observer));
    observers.extend(page.as_mut().map(|page| page as &mut dyn Observer));
    let result = run.drive(RunParts {
        source: &mut *source,
        detector: &mut *options.run.detector.detector(&camera),
        observers: &mut observers,
        operator,
        timeout: options.run.timeout,
        interrupted: &interrupted,
    });
    drop(page);
    // A device ends its own recording.
    drop(source);
    outputs.conclude(result, |summary| {
        if options.run.json {
            print::result(serde_json::to_string(summary)?)?;
        }
        Ok(())
    })
}
