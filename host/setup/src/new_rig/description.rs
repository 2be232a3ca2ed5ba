//! Description of a new rig, and the limits that follow from its size.

use std::path::PathBuf;

use nalgebra::Point3;
use plumb_cameras::stream::StreamAddress;
use plumb_frame::camera::Camera;
use plumb_runtime::rig::{BoardName, CABLE_PER_TURN_RANGE_M, Stiffness};

use super::driver::DriverKind;
use super::triangle::{SizeError, Triangle, WorkspaceBox, check_length};

/// Diameters of the ball, metres.
pub const BALL_RANGE_M: [f64; 2] = [0.02, 0.3];

/// Speed of a cable at the highest rate of a new file, m/s: slow enough to follow and to stop.
const CABLE_SPEED_M_S: f64 = 0.05;
/// Acceleration of a cable, m/s².
const CABLE_ACCELERATION_M_S2: f64 = 0.25;
/// Cable that a motor winds while its ball does not follow, until the board stops, metres:
/// docs/use/rig-file.md, below its table.
const FOLLOWING_CABLE_M: f64 = 0.19;
/// Highest rate of a new file, full steps/s: what the slowest drivers follow.
const MAX_RATE: f64 = 300.0;

/// Source of the pictures of a new rig.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NewCamera {
    /// A camera through OpenNI2.
    Openni,
    /// An Intel RealSense camera.
    Realsense,
    /// A webcam, without depth.
    Webcam,
    /// A camera that another node of ROS 2 publishes.
    Ros2,
    /// A recording.
    Recording(PathBuf),
    /// Frames that another program sends to this address.
    Stream(StreamAddress),
    /// A simulated rig, which the program renders.
    Simulated,
}

/// Description of a rig, from which its files are written.
#[derive(Debug, Clone, PartialEq)]
pub struct NewRig {
    /// Serial port of the board.
    pub port: String,
    /// Kind of the board.
    pub board: BoardName,
    /// Motor drivers.
    pub driver: DriverKind,
    /// Microsteps in a full step.
    pub microsteps: u8,
    /// Sides AB, BC, CA of the triangle of the motors, metres.
    pub sides: [f64; 3],
    /// Height of the guides above the floor, metres.
    pub height: f64,
    /// Full steps in a turn of a motor: 200 of 1.8°, or 400 of 0.9°.
    pub steps_per_turn: u16,
    /// Cable that a turn of a motor winds, metres.
    pub cable_per_turn: f64,
    /// How much the cables stretch.
    pub stiffness: Stiffness,
    /// Source of the pictures.
    pub camera: NewCamera,
    /// Camera of a recording, whose intrinsics and pose are taken; `None` where they are not known.
    pub recorded: Option<Camera>,
    /// Diameter of the ball, metres.
    pub ball_diameter: f64,
    /// Hue of the ball, degrees, 0 to 360: 0 red, 60 yellow, 120 green, 240 blue.
    pub ball_hue: f64,
}

impl Default for NewRig {
    /// Returns a rig of the size of the paper's, with TMC2209 drivers at 16 microsteps, drums with
    /// a radius of 15 mm, a camera through OpenNI2 and a red ball of 80 mm.
    fn default() -> Self {
        Self {
            port: "/dev/ttyACM0".to_owned(),
            board: BoardName::Pico,
            driver: DriverKind::Tmc2209,
            microsteps: 16,
            sides: [0.61, 0.88, 0.93],
            height: 0.66,
            steps_per_turn: 200,
            cable_per_turn: 0.094,
            stiffness: Stiffness::Unknown,
            camera: NewCamera::Openni,
            recorded: None,
            ball_diameter: 0.08,
            ball_hue: 0.0,
        }
    }
}

/// Values that follow from the size of a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    pub(super) motors: [Point3<f64>; 3],
    pub(super) workspace: WorkspaceBox,
    /// Cable of a full step, metres.
    pub(super) cable_per_step: f64,
    /// Largest travel either way, full steps.
    pub(super) travel: f64,
    /// Highest rate, full steps/s.
    pub(super) max_rate: f64,
    /// Highest acceleration, full steps/s².
    pub(super) max_acceleration: f64,
    /// Steps after which a ball that does not follow stops the board, full steps.
    pub(super) following_turn: f64,
}

impl Limits {
    pub(super) fn of(rig: &NewRig) -> Result<Self, SizeError> {
        check_length("the cable of a turn", rig.cable_per_turn, CABLE_PER_TURN_RANGE_M)?;
        check_length("the ball's diameter", rig.ball_diameter, BALL_RANGE_M)?;
        let triangle = Triangle::new(rig.sides, rig.height)?;
        let workspace = triangle.workspace(rig.ball_diameter)?;
        let cable_per_step = rig.cable_per_turn / f64::from(rig.steps_per_turn);
        let tens = |steps: f64| (steps / 10.0).ceil() * 10.0;
        Ok(Self {
            motors: triangle.motors(),
            workspace,
            cable_per_step,
            travel: tens(triangle.largest_change(&workspace) / cable_per_step),
            max_rate: tens(CABLE_SPEED_M_S / cable_per_step).min(MAX_RATE),
            max_acceleration: tens(CABLE_ACCELERATION_M_S2 / cable_per_step),
            following_turn: (FOLLOWING_CABLE_M / cable_per_step / 10.0).round() * 10.0,
        })
    }
}
