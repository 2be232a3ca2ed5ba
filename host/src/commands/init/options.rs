//! Options of `plumb init`.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use plumb_cameras::stream::StreamAddress;
use plumb_runtime::link::windows_port;
use plumb_runtime::rig::{BoardName, Stiffness};
use plumb_setup::new_rig::DriverKind;

use super::colour;
use crate::cli::numbers;
use crate::cli::numbers::sides;

/// Write a rig file and a camera file for a new rig
///
/// Asks for the rig's size, motors and camera; the defaults are in brackets. Writes rig.toml and
/// camera.toml with an explanation of each key, and limits that fit the rig's size. Never
/// overwrites a file. Lengths are in metres.
#[derive(Parser)]
#[command(after_help = examples![
    "plumb init my-rig",
    "plumb init trial --simulated --yes",
    "plumb init wall --planar",
])]
pub(crate) struct Args {
    /// Folder of the files; it is created where it does not exist
    #[arg(default_value = ".")]
    pub(super) folder: PathBuf,
    /// Ask nothing: options, and the defaults of the others
    #[arg(long)]
    pub(super) yes: bool,
    /// A simulated rig instead of a real one, to try everything without hardware
    #[arg(long, conflicts_with_all = ["camera", "recording", "stream"])]
    pub(super) simulated: bool,
    /// Two motors above a board, seen by any webcam: nothing is measured, a run begins with two
    /// jogs
    #[arg(long, conflicts_with_all = [
        "sides", "height", "steps_per_turn", "cable_per_turn", "cables", "ball", "camera",
        "recording", "stream",
    ])]
    pub(super) planar: bool,
    /// Kind of the board
    #[arg(long, value_enum, ignore_case = true)]
    pub(super) board: Option<BoardName>,
    /// Motor drivers; for another one with STEP and DIR choose a4988, and write its times as
    /// `driver = { step-dir = ... }` into the rig file
    #[arg(long, value_enum, ignore_case = true)]
    pub(super) driver: Option<DriverKind>,
    /// Microsteps in a full step, 1 to 16 microsteps: 1, 2, 4, 8 or 16, as the driver has them
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<u8>(1.0, 16.0, "microsteps"))]
    pub(super) microsteps: Option<u8>,
    /// Distances between the guides (where the cables leave for the ball) of motors A and B, B and
    /// C, C and A, 0.2 to 3.5 m
    #[arg(long, value_name = "AB,BC,CA", allow_hyphen_values = true)]
    #[arg(value_parser = sides)]
    pub(super) sides: Option<[f64; 3]>,
    /// Height of the guides above the floor, 0.4 to 3.5 m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::HEIGHT))]
    pub(super) height: Option<f64>,
    /// Full steps in a turn of a motor: 200 of 1.8°, 400 of 0.9°
    #[arg(long, value_name = "N", conflicts_with = "simulated", value_parser = ["200", "400"])]
    pub(super) steps_per_turn: Option<String>,
    /// Cable that a turn of a motor winds, the circumference of its drum, 0.02 to 0.5 m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::CABLE_PER_TURN))]
    pub(super) cable_per_turn: Option<f64>,
    /// How much the cables stretch
    #[arg(long, value_enum, ignore_case = true)]
    pub(super) cables: Option<Stiffness>,
    /// Diameter of the ball, 0.02 to 0.3 m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    #[arg(value_parser = ball_diameter)]
    pub(super) ball: Option<f64>,
    /// Hue of the ball, 0 to 360 degrees, or one of red, orange, yellow, green, cyan, blue, violet,
    /// purple, pink
    #[arg(long, value_name = "COLOUR", value_parser = colour::hue)]
    pub(super) colour: Option<f64>,
    /// Source of the pictures
    #[arg(long, value_enum, ignore_case = true)]
    pub(super) camera: Option<CameraName>,
    /// The recording: a TUM folder, or an .oni, .bag, .db3, .mcap or video file
    #[arg(long, value_name = "PATH")]
    pub(super) recording: Option<PathBuf>,
    /// Where another program delivers the pictures: unix:PATH, tcp:127.0.0.1:PORT, or - (standard
    /// input)
    #[arg(long, value_name = "ADDRESS", conflicts_with = "recording")]
    pub(super) stream: Option<StreamAddress>,
    /// Serial port of the board
    #[arg(long, value_parser = port)]
    pub(super) port: Option<String>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    pub(super) json: bool,
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
pub(super) enum CameraName {
    /// A camera through OpenNI2
    Openni,
    /// An Intel RealSense camera
    Realsense,
    /// A webcam, without depth
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

/// Returns the name of a serial port.
///
/// # Errors
/// Where it is one of Windows.
pub(super) fn port(text: &str) -> Result<String, String> {
    match windows_port(text) {
        Some(hint) => Err(hint.to_owned()),
        None => Ok(text.to_owned()),
    }
}
