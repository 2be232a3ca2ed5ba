//! Questions about a new rig.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use plumb_cameras::recording::{check_kind, own_camera};
use plumb_cameras::settings::kinect;
use plumb_cameras::stream::AddressError;
use plumb_config::error_chain::ErrorChain;
use plumb_config::quantity::Range;
use plumb_runtime::rig::{BoardName, Stiffness};
use plumb_setup::new_rig::{BALL_RANGE_M, DriverKind, NewCamera, NewRig, Triangle};
use plumb_vision::camera::Camera;

use super::colour;
use super::dialogue::{Dialogue, DialogueError};
use super::options::{Args, CameraName, port};
use crate::cli::exit::{Failure, failed};
use crate::cli::numbers;

/// Returns the rig of the options, and of the answers to questions about the others.
pub(super) fn rig(args: &Args, dialogue: &mut Dialogue<'_>) -> Result<NewRig, Failure> {
    let usual = usual(args.recording.as_deref().and_then(own_camera));
    if dialogue.is_interactive() {
        dialogue.tell("Lengths in metres. Enter takes the value in brackets; Ctrl-D ends.")?;
        dialogue.tell("A guide is the point from which a cable leaves its motor for the ball.")?;
    }
    let (sides, height) = size(args, &usual, dialogue)?;
    let board = board(args, &usual, dialogue)?;
    let (driver, microsteps) = motors(args, board, &usual, dialogue)?;
    // A simulated motor has those of the default.
    let simulated = args.simulated.then_some(usual.steps_per_turn);
    let given = args.steps_per_turn.as_deref().map(steps_per_turn).transpose().map_err(failed)?;
    let steps_per_turn = dialogue.given_or_ask(
        given.or(simulated),
        "Full steps in a turn of a motor (200 of 1.8°, 400 of 0.9°)",
        &usual.steps_per_turn.to_string(),
        steps_per_turn,
    )?;
    let cable_per_turn = length(
        args.cable_per_turn,
        "Cable that a turn of a motor winds (circumference of its drum)",
        (usual.cable_per_turn, &numbers::CABLE_PER_TURN),
        dialogue,
    )?;
    let stiffness = dialogue.given_or_ask(
        args.cables,
        "Cables (steel or braided line: stiff; nylon or elastic: soft; not sure: unknown)",
        usual.stiffness.name(),
        |text| {
            Stiffness::from_str(text, true).map_err(|_| "must be stiff, soft or unknown".to_owned())
        },
    )?;
    let usual_ball = (usual.ball_diameter, &numbers::BALL);
    let ball_diameter = length(args.ball, "Diameter of the ball", usual_ball, dialogue)?;
    // A simulated ball has the colour of the file.
    let ball_hue = dialogue.given_or_ask(
        args.colour.or(args.simulated.then_some(usual.ball_hue)),
        &format!("Colour of the ball ({}, or its hue in degrees)", colour::names()),
        &colour::name(usual.ball_hue),
        colour::hue,
    )?;
    let camera = camera(args, dialogue)?;
    let recorded = match &camera {
        NewCamera::Recording(path) => own_camera(path),
        _ => None,
    };
    let port = port_of_board(args, usual.port, dialogue)?;
    Ok(NewRig {
        port,
        board,
        driver,
        microsteps,
        sides,
        height,
        steps_per_turn,
        cable_per_turn,
        stiffness,
        camera,
        recorded,
        ball_diameter,
        ball_hue,
    })
}

/// Returns the defaults, with the ball of a recording.
fn usual(recorded: Option<Camera>) -> NewRig {
    let mut usual = NewRig::default();
    if let Some(camera) = recorded {
        let [least, most] = BALL_RANGE_M;
        usual.ball_diameter = camera.ball_diameter.clamp(least, most);
        usual.ball_hue = camera.ball_hue;
    }
    usual
}

/// Parses the full steps in a turn of a motor.
fn steps_per_turn(text: &str) -> Result<u16, String> {
    let steps = text.parse().ok().filter(|steps| [200, 400].contains(steps));
    steps.ok_or_else(|| "must be 200 or 400".to_owned())
}

/// Returns the serial port of the board.
fn port_of_board(
    args: &Args,
    usual: String,
    dialogue: &mut Dialogue<'_>,
) -> Result<String, Failure> {
    // The link of an emulated board may be in this folder.
    let is_named = |text: &str| !text.trim().is_empty();
    let port_of = |text: &str| match (args.simulated && is_named(text)) || text.contains('/') {
        true => port(text),
        false => port(text).and(Err("must be a path, such as /dev/ttyACM0".to_owned())),
    };
    match &args.port {
        Some(port) => port_of(port).map_err(|why| {
            let port = if is_named(port) { port } else { "''" };
            failed(format!("--port {port}: {why}"))
        }),
        // An emulated board has a port of its own, which `--port` names.
        None if args.simulated => Ok(usual),
        None => Ok(dialogue.ask("Serial port of the board", &usual, port_of)?),
    }
}

/// Returns a length from its option, or else asks for it, metres.
fn length(
    given: Option<f64>,
    question: &str,
    (default, range): (f64, &Range),
    dialogue: &mut Dialogue<'_>,
) -> Result<f64, DialogueError> {
    let (question, default) = (format!("{question}, m"), default.to_string());
    dialogue.given_or_ask(given, &question, &default, |text| range.parse(text))
}

/// Returns the sides of the triangle and its height, metres. Answers that no rig has are asked
/// again.
fn size(
    args: &Args,
    usual: &NewRig,
    dialogue: &mut Dialogue<'_>,
) -> Result<([f64; 3], f64), Failure> {
    // Answers that do not fit are the defaults of the next questions.
    let (mut sides, mut height) = (args.sides.unwrap_or(usual.sides), usual.height);
    loop {
        if args.sides.is_none() {
            for (side, name) in sides.iter_mut().zip(["A and B", "B and C", "C and A"]) {
                let question = format!("Distance between the guides of motors {name}");
                *side = length(None, &question, (*side, &numbers::SIDE), dialogue)?;
            }
        }
        let question = "Height of the guides above the floor";
        height = length(args.height, question, (height, &numbers::HEIGHT), dialogue)?;
        match Triangle::new(sides, height) {
            Ok(_) => return Ok((sides, height)),
            Err(error) => {
                let is_asked = args.sides.is_none() && args.height.is_none();
                if !(is_asked && dialogue.is_interactive()) {
                    return Err(error.into());
                }
                dialogue.tell(&format!("  {error}"))?;
            }
        }
    }
}

/// Returns the kind of the board.
fn board(
    args: &Args,
    usual: &NewRig,
    dialogue: &mut Dialogue<'_>,
) -> Result<BoardName, DialogueError> {
    let names = BoardName::ALL.map(|name| name.board().name).join(", ");
    let parse =
        |text: &str| BoardName::from_str(text, true).map_err(|_| format!("must be one of {names}"));
    let usual = usual.board.board().name;
    dialogue.given_or_ask(args.board, &format!("Board ({names})"), usual, parse)
}

/// Returns the drivers and their microsteps. A board with drivers of its own has no others.
fn motors(
    args: &Args,
    board: BoardName,
    usual: &NewRig,
    dialogue: &mut Dialogue<'_>,
) -> Result<(DriverKind, u8), DialogueError> {
    let own = (!board.board().has_free_drivers).then_some(DriverKind::Tmc2209Uart);
    let names = DriverKind::ALL.map(DriverKind::name).join(", ");
    let question = format!("Motor drivers ({names})");
    let driver =
        dialogue.given_or_ask(args.driver.or(own), &question, usual.driver.name(), |text| {
            DriverKind::from_str(text, true).map_err(|_| format!("must be one of {names}"))
        })?;
    let list: Vec<String> = driver.microsteps().iter().map(u8::to_string).collect();
    let list = list.join(", ");
    let question = format!("Microsteps in a full step ({list})");
    let usual = usual.microsteps.to_string();
    let microsteps = dialogue.given_or_ask(args.microsteps, &question, &usual, |text| {
        let number = text.strip_prefix("1/").unwrap_or(text);
        let microsteps = number.parse().map_err(|_| format!("must be one of {list}"))?;
        driver.straps(microsteps).map_err(|error| error.to_string())?;
        Ok(microsteps)
    })?;
    Ok((driver, microsteps))
}

/// Returns the source of the pictures.
fn camera(args: &Args, dialogue: &mut Dialogue<'_>) -> Result<NewCamera, Failure> {
    if args.simulated {
        return Ok(NewCamera::Simulated);
    }
    let recording = args.recording.as_ref().map(|_| CameraName::Recording);
    let stream = args.stream.as_ref().map(|_| CameraName::Stream);
    let names = "openni, realsense, webcam, ros2, recording, stream";
    let question = format!("Camera ({names})");
    let given = args.camera.or(recording).or(stream);
    let name =
        dialogue.given_or_ask(given, &question, "openni", |text| {
            match CameraName::from_str(text, true) {
                Ok(CameraName::Kinect) => Err(kinect()),
                name => name.map_err(|_| format!("must be one of {names}")),
            }
        })?;
    if name != CameraName::Recording && args.recording.is_some() {
        return Err(failed("--recording is for --camera recording, not for a live camera"));
    }
    if name != CameraName::Stream && args.stream.is_some() {
        return Err(failed("--stream is for --camera stream, not for another one"));
    }
    match name {
        CameraName::Openni => Ok(NewCamera::Openni),
        CameraName::Realsense => Ok(NewCamera::Realsense),
        CameraName::Webcam => Ok(NewCamera::Webcam),
        CameraName::Ros2 => Ok(NewCamera::Ros2),
        CameraName::Recording => recorded(args.recording.as_deref(), dialogue),
        CameraName::Stream => {
            let given = args.stream.clone();
            let address =
                dialogue.given_or_ask(given, "Address of the stream", STREAM, |text| {
                    text.parse().map_err(|error: AddressError| error.to_string())
                })?;
            Ok(NewCamera::Stream(address))
        }
        CameraName::Kinect => Err(failed(format!("--camera kinect: {}", kinect()))),
    }
}

/// Default address of a stream: a Unix socket beside the rig file.
const STREAM: &str = "unix:camera.sock";

/// Answer to an empty path of a recording.
const NO_PATH: &str = "write the path of a TUM folder, or of an .oni, .bag, .db3, .mcap or video \
                       file";

/// Returns the recording at `path`, or at the path that the dialogue asks for.
fn recorded(path: Option<&Path>, dialogue: &mut Dialogue<'_>) -> Result<NewCamera, Failure> {
    match path {
        Some(path) => recording(path).map_err(failed),
        None if !dialogue.is_interactive() => {
            Err(failed("--camera recording needs --recording PATH"))
        }
        None => Ok(dialogue.ask("Path of the recording", "", |text| match text {
            "" => Err(NO_PATH.to_owned()),
            path => recording(Path::new(path)),
        })?),
    }
}

/// Returns the recording at `path`, as an absolute path: the rig file may be in another folder.
fn recording(path: &Path) -> Result<NewCamera, String> {
    let absolute: Result<PathBuf, _> = path.canonicalize();
    let absolute = absolute.map_err(|error| format!("{}: {error}", path.display()))?;
    check_kind(path).map_err(|error| ErrorChain(&error).to_string())?;
    Ok(NewCamera::Recording(absolute))
}
