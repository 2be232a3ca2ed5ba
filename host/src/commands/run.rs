//! `plumb run` and `plumb goto`: a board, a camera, targets.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use plumb::camera::Camera;
use plumb::link::Serial;
use plumb::rig::Rig;
use plumb::session::{Place, Session, SessionError};
use plumb::source::simulated::{FollowingWorld, SimulatedCamera, Timing};
use plumb::source::synthetic::{Background, Options, Room, SyntheticCamera};

use super::show::{Progress, ended};
use super::{DetectorName, Failure, OrFail, Physics, interrupt_flag};

/// Drive the ball through the targets of a rig file
///
/// The camera is simulated where the rig file has a [simulation] table: the board, real or emulated, is then tried
/// without a rig, and what it says of its motors moves a simulated one.
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
    x: f64,
    /// Along the line from motor B to motor A
    y: f64,
    /// Upwards
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
    /// Detector
    #[arg(long, value_enum, default_value = "ball")]
    detector: DetectorName,
    /// How a simulated rig behaves
    #[arg(long, value_enum, default_value = "quasi-static")]
    physics: Physics,
    /// Seconds until a target is given up
    #[arg(long, default_value_t = 120.0)]
    patience: f64,
    /// Folder for the run, new or empty [default: the next number under runs/]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
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

fn drive(file: &Path, rig: Rig, options: &Common) -> Result<ExitCode, Failure> {
    let camera = Camera::read(&rig.camera.file).or_bad_input()?;
    let Some(simulation) = &rig.simulation else {
        let message = format!(
            "{}: there is no [simulation] table, and this version has no driver for a real camera yet",
            file.display()
        );
        return Err(message).or_bad_input();
    };
    let motors = *simulation.geometry().or_bad_input()?.motors();
    let world = FollowingWorld::new(options.physics.plant(simulation).or_bad_input()?);
    let background = Background::Room(Room::furnished());
    let synthetic = SyntheticCamera::new(camera.clone(), background, Options::default(), 1).or_bad_input()?;
    let mut source = SimulatedCamera::new(world, synthetic, motors, Timing::default());

    let transport =
        Serial::open(options.port.as_ref().unwrap_or(&rig.board.port), rig.board.baud).or_bad_input()?;
    let interrupted = interrupt_flag()?;
    let progress = Progress::new();
    let mut detector = options.detector.detector(&camera);
    let session = Session {
        rig: &rig,
        camera: &camera,
        detector: &mut *detector,
        place: options.out.clone().map_or(Place::Numbered("run"), Place::Folder),
        patience: options.patience,
        interrupted: &interrupted,
        progress: &mut |row| progress.show(row),
    };
    let result = session.run(&mut source, transport);
    progress.done();
    let print = |summary| -> Result<(), Failure> {
        if options.json {
            println!("{}", serde_json::to_string(summary).or_failed()?);
        }
        Ok(())
    };
    match result {
        Ok((summary, folder)) => {
            let code = ended(&summary, &folder);
            print(&summary)?;
            Ok(code)
        }
        Err(SessionError::Broken { error, folder, summary }) => {
            print(&summary)?;
            Err(SessionError::Broken { error, folder, summary }).or_failed()
        }
        Err(error) => Err(error).or_bad_input(),
    }
}
