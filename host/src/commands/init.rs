//! `plumb init`: a new rig file and camera file, by questions or from options.

mod advice;
mod colour;
mod dialogue;
mod questions;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use nix::unistd::{AccessFlags, access};
use plumb_cameras::recording::own_camera_file;
use plumb_cameras::stream::StreamAddress;
use plumb_config::book::page;
use plumb_config::whole_writes::write_new;
use plumb_runtime::rig::{BoardName, Stiffness};
use plumb_setup::new_rig::{DriverKind, NewCamera, NewFiles, NewRig};
use serde::Serialize;

use self::advice::{next_step, notes};
use self::dialogue::Dialogue;
use crate::cli::exit::{Failure, Unwritten, Work, failed};
use crate::cli::number_list::sides;
use crate::cli::numbers;
use crate::cli::print::{self, Questions, note};

/// Write a rig file and a camera file for a new rig
///
/// Asks for the rig's size, motors and camera; the defaults are in brackets. Writes rig.toml and
/// camera.toml with an explanation of each key, and limits that fit the rig's size. Never
/// overwrites a file. Lengths are in metres.
#[derive(Parser)]
#[command(after_help = examples!["plumb init my-rig", "plumb init trial --simulated --yes"])]
pub(crate) struct Args {
    /// Folder of the files; it is created where it does not exist
    #[arg(default_value = ".")]
    folder: PathBuf,
    /// Ask nothing: options, and the defaults of the others
    #[arg(long)]
    yes: bool,
    /// A simulated rig instead of a real one, to try everything without hardware
    #[arg(long, conflicts_with_all = ["camera", "recording", "stream"])]
    simulated: bool,
    /// Kind of the board
    #[arg(long, value_enum, ignore_case = true)]
    board: Option<BoardName>,
    /// Motor drivers; for another one with STEP and DIR choose a4988, and write its times as
    /// `driver = { step-dir = ... }` into the rig file
    #[arg(long, value_enum, ignore_case = true)]
    driver: Option<DriverKind>,
    /// Microsteps in a full step, 1 to 16 microsteps: 1, 2, 4, 8 or 16, as the driver has them
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u8>(1.0, 16.0, "microsteps"))]
    microsteps: Option<u8>,
    /// Distances between the guides (where the cables leave for the ball) of motors A and B, B and
    /// C, C and A, 0.2 to 3.5 m
    #[arg(long, value_name = "AB,BC,CA", allow_hyphen_values = true)]
    #[arg(value_parser = sides)]
    sides: Option<[f64; 3]>,
    /// Height of the guides above the floor, 0.4 to 3.5 m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::HEIGHT))]
    height: Option<f64>,
    /// Full steps in a turn of a motor: 200 of 1.8°, 400 of 0.9°
    #[arg(long, value_name = "N", conflicts_with = "simulated", value_parser = ["200", "400"])]
    steps_per_turn: Option<String>,
    /// Cable that a turn of a motor winds, the circumference of its drum, 0.02 to 0.5 m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::CABLE_PER_TURN))]
    cable_per_turn: Option<f64>,
    /// How much the cables stretch
    #[arg(long, value_enum, ignore_case = true)]
    cables: Option<Stiffness>,
    /// Diameter of the ball, 0.02 to 0.3 m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    #[arg(value_parser = ball_diameter)]
    ball: Option<f64>,
    /// Hue of the ball, 0 to 360 degrees, or one of red, orange, yellow, green, cyan, blue, violet,
    /// purple, pink
    #[arg(long, value_name = "COLOUR", value_parser = colour::hue)]
    colour: Option<f64>,
    /// Source of the pictures
    #[arg(long, value_enum, ignore_case = true)]
    camera: Option<CameraName>,
    /// The recording: a TUM folder, or an .oni, .bag, .db3, .mcap or video file
    #[arg(long, value_name = "PATH")]
    recording: Option<PathBuf>,
    /// Where another program delivers the pictures: unix:PATH, tcp:127.0.0.1:PORT, or - (standard
    /// input)
    #[arg(long, value_name = "ADDRESS", conflicts_with = "recording")]
    stream: Option<StreamAddress>,
    /// Serial port of the board
    #[arg(long, value_parser = questions::port)]
    port: Option<String>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Parses the diameter of the ball.
///
/// # Errors
/// An explanation; for a colour, which a person may take for the ball, with its option.
fn ball_diameter(text: &str) -> Result<f64, String> {
    let is_colour = text.parse::<f64>().is_err() && colour::hue(text).is_ok();
    let option = if is_colour { "; the ball's colour is --colour" } else { "" };
    numbers::BALL.parse(text).map_err(|error| format!("{error}{option}"))
}

/// Name of a source of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CameraName {
    /// A camera through OpenNI2
    Openni,
    /// An Intel RealSense camera
    Realsense,
    /// A webcam, without depth; a program that is built with --features webcam reads it
    Webcam,
    /// Another node of ROS 2; a program that is built with --features ros2 reads it
    Ros2,
    /// A recording
    Recording,
    /// Another program
    Stream,
    /// No source, but a camera that several of them read
    #[value(hide = true)]
    Kinect,
}

/// Line of JSON.
#[derive(Serialize)]
struct Line<'a> {
    rig: &'a Path,
    camera: &'a Path,
    straps: Option<String>,
}

pub(crate) fn prepare(args: Args) -> Result<Work, Failure> {
    let [rig_path, camera_path] = ["rig.toml", "camera.toml"].map(|name| args.folder.join(name));
    // Before the questions, so that no answer is lost.
    for path in [&rig_path, &camera_path] {
        if path.symlink_metadata().is_ok() {
            return Err(failed(format!(
                "{}: exists; nothing was written. Remove it, or give another folder",
                path.display()
            )));
        }
    }
    check_writable(&args.folder, &rig_path)?;
    let mut dialogue = Dialogue::new(io::stdin().lock(), Questions, !args.yes);
    let rig = questions::rig(&args, &mut dialogue)?;
    let files = rig.files()?;
    Ok(Box::new(move || write(&args, &rig, &files, [&rig_path, &camera_path])))
}

/// Writes the files of a rig, and says what a person must know of them.
fn write(
    args: &Args,
    rig: &NewRig,
    files: &NewFiles,
    [rig_path, camera_path]: [&Path; 2],
) -> Result<ExitCode, Failure> {
    write_files(&args.folder, rig_path, camera_path, files)?;
    note!("written: {} and {}", rig_path.display(), camera_path.display());
    if let Some(sender) = sender(&rig.camera, &args.folder) {
        note!("pictures: {sender} (`camera.stream` in the rig file; {})", page("stream"));
    }
    if let (NewCamera::Recording(recording), Some(own)) = (&rig.camera, &rig.recorded) {
        let ball = (rig.ball_diameter, rig.ball_hue);
        let is_same_ball = ball == (own.ball_diameter, own.ball_hue);
        let taken = if is_same_ball { "intrinsics, pose and ball" } else { "intrinsics and pose" };
        note!("camera: {taken} are those of {}", own_camera_file(recording).display());
    }
    if let Some(straps) = &files.straps {
        let end = if rig.microsteps == 1 { "" } else { "s" };
        note!("straps of each driver for {} microstep{end}: {straps}", rig.microsteps);
    }
    for text in notes(rig) {
        note!("note: {text}");
    }
    note!("next: {}", next_step(rig, rig_path));
    if args.json {
        let straps = files.straps.as_ref().map(|straps| straps.to_string());
        let line = Line { rig: rig_path, camera: camera_path, straps };
        print::result(serde_json::to_string(&line)?)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Checks that `file` can be written into `folder`, or into the folder that it will be created in.
fn check_writable(folder: &Path, file: &Path) -> Result<(), Failure> {
    let mut folders = folder.ancestors().map(|it| match it.as_os_str().is_empty() {
        true => Path::new("."),
        false => it,
    });
    let Some(existing) = folders.find(|it| it.exists()) else { return Ok(()) };
    let access = access(existing, AccessFlags::W_OK).map_err(io::Error::from);
    Ok(access.map_err(Unwritten::at(file))?)
}

/// Returns where the pictures of another program are expected, for a person; `None` for other
/// cameras. A socket is beside the rig file in `folder`.
fn sender(camera: &NewCamera, folder: &Path) -> Option<String> {
    let NewCamera::Stream(address) = camera else { return None };
    let mut address = address.clone();
    address.relative_to(folder);
    Some(match address {
        StreamAddress::StandardInput => "another program writes them to standard input".to_owned(),
        _ => format!("another program sends them to {address}, where a run listens"),
    })
}

/// Writes both files, or none.
fn write_files(
    folder: &Path,
    rig_path: &Path,
    camera_path: &Path,
    files: &NewFiles,
) -> Result<(), Unwritten> {
    fs::create_dir_all(folder).map_err(Unwritten::at(folder))?;
    write_new(rig_path, files.rig.as_bytes()).map_err(Unwritten::at(rig_path))?;
    write_new(camera_path, files.camera.as_bytes()).map_err(|error| {
        // The rig file is of no use without it.
        let _ = fs::remove_file(rig_path);
        Unwritten::at(camera_path)(error)
    })
}
