//! Texts of a new rig file and camera file. The reference pages explain their keys.

use nalgebra::Point3;
use plumb_cameras::camera_file::{self, DISTORTION_KEYS, NO_DEPTH};
use plumb_config::book::with_pages;
use plumb_config::reference::{Key, keys};
use plumb_frame::camera::{CalibratedFor, Camera, Intrinsics};
use plumb_runtime::rig::REFERENCE;

use super::description::{Limits, NewCamera, NewRig};
use super::driver::Straps;
use super::triangle::WorkspaceBox;

/// Tables that [`rig_file`] writes key by key or leaves out. It writes the others with their
/// defaults.
const OWN_TABLES: [&str; 11] = [
    "targets",
    "board",
    "law",
    "motors",
    "cables",
    "workspace",
    "following",
    "size",
    "camera",
    "simulation",
    "plane",
];

/// Text of a TOML file under construction.
struct Writer {
    text: String,
    keys: Vec<Key>,
}

impl Writer {
    /// Starts a file with this introduction. `page` is the reference page of its format.
    fn new(page: &str, introduction: &str) -> Self {
        Self { text: introduction.to_owned(), keys: keys(page) }
    }

    /// Starts a table, after a comment.
    fn table(&mut self, name: &str, comment: &str) {
        self.text.push('\n');
        self.comment(comment);
        self.text.push_str(&format!("[{name}]\n"));
    }

    fn comment(&mut self, comment: &str) {
        for line in comment.lines() {
            self.text.push_str(&format!("# {line}\n"));
        }
    }

    /// Writes the key `name`, given with its tables, and a comment: meaning, unit, range.
    fn key(&mut self, name: &str, value: &str) {
        let key = self.keys.iter().find(|key| key.name == name);
        let comment = key.map(explanation).unwrap_or_default();
        let last = name.rsplit('.').next().unwrap_or(name);
        self.comment(&comment);
        self.text.push_str(&format!("{last} = {value}\n"));
    }

    /// Writes a key as [`key`](Self::key) does, with a value that the calibration replaces. So it
    /// does with the comment behind it: "a guess", and `meaning`.
    fn guess(&mut self, name: &str, value: &str, meaning: &str) {
        self.key(name, &format!("{value}  # a guess{meaning}"));
    }

    /// Writes the tables of the format that are not in `own`, with their defaults.
    fn other_tables(&mut self, own: &[&str]) {
        let mut current = String::new();
        for Key { name, value, .. } in self.keys.clone() {
            let Some((table, _)) = name.rsplit_once('.') else { continue };
            let outer = table.split('.').next().unwrap_or(table);
            if own.contains(&outer) || value.is_empty() {
                continue;
            }
            if table != current {
                self.table(table, "");
                table.clone_into(&mut current);
            }
            self.key(&name, &value);
        }
    }
}

/// Returns the comment of a key: "Meaning [unit; range]".
fn explanation(key: &Key) -> String {
    let unit = if key.unit == "1" { "" } else { &key.unit };
    let allowed: Vec<&str> = [unit, &key.range].into_iter().filter(|t| !t.is_empty()).collect();
    let mut meaning = key.meaning.chars();
    let first = meaning.next().into_iter().flat_map(char::to_uppercase);
    let meaning: String = first.chain(meaning).collect();
    match allowed.as_slice() {
        [] => meaning,
        allowed => format!("{meaning} [{}]", allowed.join("; ")),
    }
}

/// Formats a length with millimetres, or a number of steps.
fn number(value: f64) -> String {
    format!("{:?}", (value * 1e3).round() / 1e3)
}

fn point(point: Point3<f64>) -> String {
    let [x, y, z] = [point.x, point.y, point.z].map(number);
    format!("[{x}, {y}, {z}]")
}

fn points(points: [Point3<f64>; 3]) -> String {
    let [a, b, c] = points.map(point);
    format!("[{a}, {b}, {c}]")
}

const RIG_INTRODUCTION: &str = "\
# A rig, as `plumb init` wrote it. Lengths in metres, times in seconds, motor positions in full
# steps; + pays cable out. The origin of the rig frame is on the floor: x is 0 at motor C and points
# to A and B, y is 0 at motor B and points to A, z points up. docs/use/rig.md has a drawing.
# After each change: `plumb check --file-only`.
";

/// Returns the text of the rig file.
pub(super) fn rig_file(rig: &NewRig, limits: &Limits, straps: Option<&Straps>) -> String {
    let mut file = Writer::new(REFERENCE, RIG_INTRODUCTION);
    file.text.push('\n');
    file.key("targets", &format!("[{}]", point(limits.workspace.at([0.5; 3]))));
    file.table("board", "");
    file.key("board.port", &format!("{:?}", rig.port));
    file.key("board.kind", &format!("{:?}", rig.board.board().name));
    file.text.push_str("\n# Without a table [law.NAME] the law is `taut`.\n");
    motors(&mut file, rig, limits, straps);
    file.table("cables", "");
    file.key("cables.stiffness", &format!("{:?}", rig.stiffness.name()));
    file.table("workspace", "Inside the triangle, above the floor and below the motors.");
    file.key("workspace.min", &point(limits.workspace.min));
    file.key("workspace.max", &point(limits.workspace.max));
    file.other_tables(&OWN_TABLES);
    file.table("following", "turn: as many steps as wind about 0.2 m of cable.");
    file.key("following.turn", &number(limits.following_turn));
    file.key("following.movement", "0.02");
    file.table("size", "By tape measure. The check uses it, and jogs in millimetres; no law does.");
    file.key("size.motors", &points(limits.motors));
    file.key("size.floor", "0.0");
    // A tenth of a micrometre.
    file.key("size.cable_per_step", &format!("{:.7}", limits.cable_per_step));
    camera(&mut file, rig);
    if rig.camera == NewCamera::Simulated {
        simulation(&mut file, limits);
    }
    with_pages(&file.text)
}

const MOTORS_COMMENT: &str = "\
Low rates for a first move: about 50 mm of cable a second. The travel is what the workspace takes,
from anywhere in it.";

fn motors(file: &mut Writer, rig: &NewRig, limits: &Limits, straps: Option<&Straps>) {
    file.table("motors", MOTORS_COMMENT);
    file.key("motors.max_rate", &number(limits.max_rate));
    file.key("motors.max_acceleration", &number(limits.max_acceleration));
    file.key("motors.microsteps", &rig.microsteps.to_string());
    file.comment("(16 at most: the board drives no finer ones, such as the 32 of a TMC2209.)");
    if let Some(straps) = straps {
        file.comment(&format!("(Straps of each driver for this: {straps}.)"));
    }
    file.key("motors.travel", &format!("[{}, {}]", number(-limits.travel), number(limits.travel)));
    file.key("motors.reversed", "[false, false, false]");
    file.key("motors.driver", &rig.driver.toml());
}

fn camera(file: &mut Writer, rig: &NewRig) {
    file.table("camera", "");
    file.key("camera.file", "\"camera.toml\"");
    match &rig.camera {
        NewCamera::Openni => file.key("camera.source", "\"openni\""),
        NewCamera::Realsense => file.key("camera.source", "\"realsense\""),
        NewCamera::Webcam => file.key("camera.source", "\"webcam\""),
        NewCamera::Ros2 => file.key("camera.source", "\"ros2\""),
        NewCamera::Recording(path) => {
            file.key("camera.recording", &format!("{:?}", path.display().to_string()));
        }
        NewCamera::Stream(address) => {
            file.key("camera.source", "\"stream\"");
            file.key("camera.stream", &format!("{:?}", address.to_string()));
        }
        NewCamera::Simulated => {}
    }
}

fn simulation(file: &mut Writer, limits: &Limits) {
    file.table("simulation", "The simulated rig, in place of a real one.");
    file.key("simulation.motors", &points(limits.motors));
    let circumference = limits.cable_per_step * plumb_runtime::rig::FULL_STEPS_PER_REVOLUTION;
    let radius = format!("{:.6}", circumference / std::f64::consts::TAU);
    file.key("simulation.pulley_radii", &format!("[{radius}, {radius}, {radius}]"));
    file.key("simulation.start", &point(limits.workspace.at([0.8, 0.3, 0.8])));
    file.key("simulation.wiring", "[\"A\", \"B\", \"C\"]");
    file.key("simulation.reversed", "[false, false, false]");
}

const CAMERA_INTRODUCTION: &str = "\
# A camera, as `plumb init` wrote it. Values that are a guess say so; the calibration replaces them,
# and the comment: `plumb calibrate` the pose, and `plumb calibrate --lens` the lens of a webcam or
# of a stream. A RealSense camera and one in ROS 2 bring their own intrinsics. Through OpenNI2,
# `intrinsics = \"device\"` in [camera.openni] of the rig file takes the nominal ones.
";

/// Least distance of the guessed camera from the middle of the workspace, metres.
const CAMERA_DISTANCE_M: f64 = 1.25;
/// Half of what the guessed camera sees, at a distance of 1: across and upwards. It has 640x480
/// pixels and a focal length of 525.
const HALF_VIEW: [f64; 2] = [319.5 / 525.0, 239.5 / 525.0];

/// Returns the distance of the guessed camera from the middle of the workspace, metres: so far that
/// it sees the whole near side, with a tenth to spare.
fn camera_distance(workspace: &WorkspaceBox) -> f64 {
    let half = (workspace.max - workspace.min) / 2.0;
    let distance = half.x + 1.1 * (half.y / HALF_VIEW[0]).max(half.z / HALF_VIEW[1]);
    distance.max(CAMERA_DISTANCE_M)
}

/// Returns the text of the camera file.
pub(super) fn camera_file(rig: &NewRig, limits: &Limits) -> String {
    let mut file = Writer::new(camera_file::REFERENCE, CAMERA_INTRODUCTION);
    match &rig.recorded {
        Some(camera) => recorded(&mut file, camera),
        None => guessed(&mut file, rig, limits),
    }
    file.table("ball", "");
    file.key("ball.diameter_m", &format!("{:?}", rig.ball_diameter));
    file.key("ball.hue", &format!("{:?}", rig.ball_hue));
    file.text
}

/// Writes guessed intrinsics and a guessed pose.
fn guessed(file: &mut Writer, rig: &NewRig, limits: &Limits) {
    file.table("intrinsics", "");
    file.key("intrinsics.width", "640");
    file.key("intrinsics.height", "480");
    for (name, value) in [("fx", 525.0), ("fy", 525.0), ("cx", 319.5), ("cy", 239.5)] {
        file.guess(&format!("intrinsics.{name}"), &number(value), "");
    }
    let has_depth = rig.camera != NewCamera::Webcam;
    let depth_scale = if has_depth { number(1000.0) } else { format!("{NO_DEPTH:?}") };
    file.key("intrinsics.depth_scale", &depth_scale);
    let mut place = limits.workspace.at([0.5; 3]);
    place.x += camera_distance(&limits.workspace);
    file.table("pose", "");
    file.guess("pose.translation", &point(place), ": opposite motor C");
    file.guess("pose.quaternion", "[-0.5, -0.5, 0.5, 0.5]", ": it looks along -x, its x is y");
}

/// Writes the intrinsics and the pose of the camera of a recording.
fn recorded(file: &mut Writer, camera: &Camera) {
    const COMMENT: &str = "As in the camera file of the recording.";
    let Intrinsics { fx, fy, cx, cy, depth_scale, distortion } = camera.intrinsics;
    file.table("intrinsics", COMMENT);
    if let CalibratedFor::Size(size) = camera.calibrated_for {
        file.key("intrinsics.width", &size.width.to_string());
        file.key("intrinsics.height", &size.height.to_string());
    }
    let coefficients = distortion.map(|lens| lens.coefficients().to_array());
    let distortion = DISTORTION_KEYS.into_iter().zip(coefficients.into_iter().flatten());
    let lens = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    for (name, value) in lens.into_iter().chain(distortion) {
        file.key(&format!("intrinsics.{name}"), &format!("{value:?}"));
    }
    let has_depth = camera.intrinsics.has_depth();
    let depth_scale = if has_depth { format!("{depth_scale:?}") } else { format!("{NO_DEPTH:?}") };
    file.key("intrinsics.depth_scale", &depth_scale);
    file.table("pose", COMMENT);
    let [x, y, z] = camera.pose.translation.vector.into();
    file.key("pose.translation", &format!("[{x:?}, {y:?}, {z:?}]"));
    let [x, y, z, w] = camera.pose.rotation.coords.into();
    file.key("pose.quaternion", &format!("[{x:?}, {y:?}, {z:?}, {w:?}]"));
}
