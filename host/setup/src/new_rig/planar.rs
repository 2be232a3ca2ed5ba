//! Files of a new rig of two motors before any webcam: nothing in them is measured.

use plumb_config::book::with_pages;
use plumb_runtime::rig::BoardName;

use super::driver::DriverKind;
use super::{NewFiles, NewRigError};

/// A rig of two motors in the picture of a camera of unknown place.
#[derive(Debug, Clone, PartialEq)]
pub struct NewPlanarRig {
    /// Serial port of the board.
    pub port: String,
    /// Kind of the board.
    pub board: BoardName,
    /// Motor drivers.
    pub driver: DriverKind,
    /// Microsteps in a full step.
    pub microsteps: u8,
    /// Hue of the ball, degrees, 0 to 360.
    pub ball_hue: f64,
    /// Whether the rig is simulated, in place of a webcam.
    pub is_simulated: bool,
}

impl Default for NewPlanarRig {
    /// Returns a rig with TMC2209 drivers at 16 microsteps, a webcam and a red ball.
    fn default() -> Self {
        Self {
            port: "/dev/ttyACM0".to_owned(),
            board: BoardName::Pico,
            driver: DriverKind::Tmc2209,
            microsteps: 16,
            ball_hue: 0.0,
            is_simulated: false,
        }
    }
}

/// The simulated rig: motors a metre apart, drums of 15 and 12 mm, and a camera that is tilted by
/// 10°, turned by 15° and rolled by 8°.
const SIMULATION: &str = "
# The simulated rig and camera, in place of real ones.
[simulation]
motors = [[0.0, 1.1, 1.25], [0.0, 0.1, 1.25]]
pulley_radii = [0.015, 0.012]
start = [0.0, 0.45, 0.75]

[simulation.camera]
translation = [1.522, 0.235, 1.132]
quaternion = [-0.64184, -0.43791, 0.42288, 0.46632]
";

/// The webcam.
const WEBCAM: &str = "\
source = \"webcam\"  # the first one; `plumb cameras` lists them
# http.url = \"http://192.168.1.20:8080/video\"  # with source = \"http\": a phone, or an IP camera
";

impl NewPlanarRig {
    /// Returns the texts of the files.
    ///
    /// # Errors
    /// Where the driver cannot have these microsteps, or the board cannot have the driver.
    pub fn files(&self) -> Result<NewFiles, NewRigError> {
        let Self { port, board, driver, microsteps, ball_hue, is_simulated } = self;
        let straps = driver.straps_on(*board, *microsteps)?;
        let (source, simulation) = if *is_simulated { ("", SIMULATION) } else { (WEBCAM, "") };
        let rig = format!(
            "\
# Two motors above a board, and a camera before it, as `plumb init --planar` wrote it. Nothing here
# is measured: a run begins with two jogs. docs/use/rig-file.md explains each key.

[board]
port = {port:?}
kind = {:?}

[law.adaptive]
mean = 0.2  # running mean over the steps, seconds: it damps the swing on soft cables

[motors]
count = 2
max_rate = 150.0          # full steps/s; 400 once all is well
max_acceleration = 750.0  # full steps/s²
microsteps = {microsteps}
travel = [-5000, 5000]    # full steps from where the board started
driver = {}

[plane]
# Pixels (column, row) where the cables leave motors A and B. With them targets may be in the whole
# picture below the motors, without them in its middle third. `plumb calibrate --motors --page`
# writes them.
# motors = [[500, 60], [140, 60]]

[camera]
file = \"camera.toml\"
{source}{simulation}",
            board.board().name,
            driver.toml()
        );
        let camera = format!(
            "\
# A webcam, as `plumb init --planar` wrote it. The lens is a guess that does no harm, and the pose
# is not used: two jogs tell how the picture lies.

[intrinsics]
width = 640
height = 480
fx = 525.0
fy = 525.0
cx = 319.5
cy = 239.5
depth_scale = \"none\"

[pose]
translation = [1.5, 0.5, 0.5]
quaternion = [-0.5, -0.5, 0.5, 0.5]

[ball]
diameter_m = 0.06
hue = {ball_hue:?}  # degrees: 0 red, 60 yellow, 120 green, 240 blue
"
        );
        Ok(NewFiles { rig: with_pages(&rig), camera, straps })
    }
}
