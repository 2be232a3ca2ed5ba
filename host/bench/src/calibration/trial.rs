//! One calibration of a simulated camera.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use plumb_calibrate::board::{CharucoSheet, Placement};
use plumb_calibrate::board_pose::{BoardView, average, pose_from_board};
use plumb_calibrate::calibration::{Calibration, CalibrationError, Grade};
use plumb_calibrate::corners::{SheetError, find_corners};
use plumb_calibrate::motors::{MotorMeasures, SeenMotor, pose_from_motors};
use plumb_calibrate::places::{BallPlace, PLACE_SD_M, pose_from_places};
use plumb_calibrate::render::draw_board;
use plumb_emulator::plant::{RigError, Task};
use plumb_protocol::PerMotor;
use plumb_vision::camera::Intrinsics;
use plumb_vision::frame::{FrameError, RgbdFrame};
use plumb_vision::observation::Gaussian3;
use plumb_vision::render::Scene;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use thiserror::Error;

use super::CalibrationWay;
use crate::run_id::RunId;

/// Calibrations of one camera before it is given up.
pub const MAX_ATTEMPTS: u64 = 8;

/// Stream of the random numbers of calibrations.
const STREAM: u64 = 1 << 41;

/// A PrimeSense camera at 640x480.
const INTRINSICS: Intrinsics = Intrinsics {
    fx: 525.0,
    fy: 525.0,
    cx: 319.5,
    cy: 239.5,
    depth_scale: 5000.0,
    distortion: None,
};
/// Rows and columns, pixels.
const SIZE: [f64; 2] = [640.0, 480.0];

/// Standard deviations of the errors.
struct Errors {
    /// Depth at 1 m, metres; it grows with the square of the depth. Khoshelham and Elberink 2012.
    depth_m: f64,
    /// Scale of all depths of a camera. Assumed.
    depth_scale: f64,
    /// Grey levels of a pixel. Assumed, as in the synthetic camera.
    grey: f64,
    /// Place of the board that a person measures, each axis, metres. Assumed.
    board_m: f64,
    /// Direction of the board that a person measures, about each axis, radians. Assumed.
    board_rad: f64,
    /// Height of the motors that a person measures, metres. Assumed.
    height_m: f64,
    /// Pixel that a person chooses, pixels. Assumed.
    click_px: f64,
    /// Point of a motor at which the depth is read, metres. Assumed.
    motor_m: f64,
    /// Centre of the ball that the detector finds, pixels. Plain scenes of `plumb-lab vision`.
    ball_px: f64,
}

const ERRORS: Errors = Errors {
    depth_m: 0.001_4,
    depth_scale: 0.005,
    grey: 2.0,
    board_m: 0.003,
    board_rad: 0.01,
    height_m: 0.003,
    click_px: 1.5,
    motor_m: 0.005,
    ball_px: 0.3,
};

/// Frames of the board.
const BOARD_FRAMES: usize = 3;
/// Places of the ball.
const PLACES: usize = 6;

/// Result of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Result; its pose is from camera axes into the rig frame.
    pub found: Calibration,
    /// The camera's true pose.
    pub true_pose: Isometry3<f64>,
    /// Ratio of the camera's depths to the true ones.
    pub depth_scale: f64,
    /// Number of calibrations that were refused or poor before it.
    pub refused: u64,
}

/// Reason that a simulated calibration gave no result.
#[derive(Debug, Error)]
pub enum TrialError {
    /// The board is not found.
    #[error(transparent)]
    Board(#[from] SheetError),
    /// The samples determine no pose.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The rendered frame is invalid.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The rig is invalid.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The result is poor.
    #[error("the calibration is poor")]
    Poor,
}

impl Trial {
    /// Returns the position, rig frame, metres, that the camera measures for a true one.
    #[must_use]
    pub fn measured(&self, p: &Point3<f64>) -> Point3<f64> {
        let seen = self.true_pose.inverse_transform_point(p);
        self.found.pose * (seen * self.depth_scale)
    }

    /// Returns the true position, rig frame, metres, of a measured one.
    #[must_use]
    pub fn true_position(&self, p: &Point3<f64>) -> Point3<f64> {
        let seen = self.found.pose.inverse_transform_point(p);
        self.true_pose * (seen / self.depth_scale)
    }

    /// Returns the angle between the found and the true direction, radians.
    #[must_use]
    pub fn rotation_error(&self) -> f64 {
        self.found.pose.rotation.angle_to(&self.true_pose.rotation)
    }
}

/// Calibrates the camera of a rig, again after each refused or poor result.
///
/// # Errors
/// The last error if [`MAX_ATTEMPTS`] calibrations fail.
pub fn trial(way: CalibrationWay, task: &Task, id: RunId) -> Result<Trial, TrialError> {
    let mut refused = 0;
    loop {
        let mut random = ChaCha8Rng::seed_from_u64(id.seed.wrapping_add(refused << 32));
        random.set_stream(STREAM | id.rig);
        match attempt(way, task, &mut random) {
            Ok(trial) => return Ok(Trial { refused, ..trial }),
            Err(error) if refused + 1 >= MAX_ATTEMPTS => return Err(error),
            Err(_) => refused += 1,
        }
    }
}

fn attempt(way: CalibrationWay, task: &Task, random: &mut ChaCha8Rng) -> Result<Trial, TrialError> {
    let motors = task.geometry.motors();
    let true_pose = camera_pose(motors, random);
    let depth_scale = 1.0 + ERRORS.depth_scale * normal(random);
    let mut view = View { true_pose, depth_scale, random };
    let found = match way {
        CalibrationWay::Board => view.board(motors)?,
        CalibrationWay::Motors => view.motors(motors)?,
        CalibrationWay::Ball => view.ball(motors)?,
    };
    if found.grade() == Grade::Poor {
        return Err(TrialError::Poor);
    }
    Ok(Trial { found, true_pose, depth_scale, refused: 0 })
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Returns a vector whose entries have the standard deviation `sd`.
fn vector(sd: f64, random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::new(normal(random), normal(random), normal(random)) * sd
}

/// Returns the middle of the rig's workspace, 0.25 m below the motors.
pub(super) fn middle(motors: &PerMotor<Point3<f64>>) -> Point3<f64> {
    let sum: Vector3<f64> = motors.iter().map(|motor| motor.coords / 3.0).sum();
    Point3::from(sum) - Vector3::z() * 0.25
}

/// Returns the pose of a camera that looks at the rig from any side, level or from above, as near
/// as it sees all motors.
fn camera_pose(motors: &PerMotor<Point3<f64>>, random: &mut ChaCha8Rng) -> Isometry3<f64> {
    let azimuth: f64 = random.random_range(0.0..std::f64::consts::TAU);
    let elevation: f64 = random.random_range(0.0..0.5);
    let middle = middle(motors) + vector(0.03, random);
    let to_camera = Vector3::new(
        azimuth.cos() * elevation.cos(),
        azimuth.sin() * elevation.cos(),
        elevation.sin(),
    );
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.05 * normal(random));
    let mut distance = 1.0;
    loop {
        // `face_towards` gives x to the left and y up.
        let eye = middle + to_camera * distance;
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let look = Isometry3::face_towards(&eye, &middle, &Vector3::z());
        let pose = Isometry3::from_parts(look.translation, look.rotation * turned * roll);
        if distance >= 3.0 || motors.iter().all(|motor| is_in_picture(&pose, motor)) {
            return pose;
        }
        distance += 0.05;
    }
}

/// Returns whether a point is in the picture, 15 pixels or more from its edge.
fn is_in_picture(pose: &Isometry3<f64>, p: &Point3<f64>) -> bool {
    let pixel = INTRINSICS.project(&pose.inverse_transform_point(p));
    pixel.is_some_and(|(u, v)| {
        (15.0..SIZE[0] - 15.0).contains(&u) && (15.0..SIZE[1] - 15.0).contains(&v)
    })
}

/// A camera that is calibrated.
struct View<'a> {
    true_pose: Isometry3<f64>,
    depth_scale: f64,
    random: &'a mut ChaCha8Rng,
}

impl View<'_> {
    /// Returns the noise of a depth, metres.
    fn depth_noise(&mut self, z: f64, sd: f64) -> f64 {
        normal(self.random) * (ERRORS.depth_m * z * z).hypot(sd)
    }

    /// Calibrates with a board that stands 0.6 to 1.1 m before the camera.
    fn board(&mut self, motors: &PerMotor<Point3<f64>>) -> Result<Calibration, TrialError> {
        let eye = Point3::from(self.true_pose.translation.vector);
        let way = middle(motors) - eye;
        let place = eye + way.normalize() * self.random.random_range(0.6..1.1);
        // Its normal points to the camera, but for a slant to the side of 0.35 to 0.8.
        let side = if self.random.random() { 1.0 } else { -1.0 };
        let slant = side * self.random.random_range(0.35..0.8);
        let turn = (-way.y).atan2(-way.x) + std::f64::consts::FRAC_PI_2 + slant;
        let [width, height] = CharucoSheet::SHEET.size();
        let corner = Placement { origin: Point3::origin(), turn, is_upright: true }.pose()
            * Vector3::new(width / 2.0, height / 2.0, 0.0);
        let placement = Placement { origin: place - corner, turn, is_upright: true };
        let wrong_turn = UnitQuaternion::from_scaled_axis(vector(ERRORS.board_rad, self.random));
        let shift = Translation3::from(vector(ERRORS.board_m, self.random));
        let stated = placement.pose();
        let true_place =
            Isometry3::from_parts(shift * stated.translation, wrong_turn * stated.rotation);
        let board_to_camera = self.true_pose.inverse() * true_place;
        let mut views = Vec::new();
        for _ in 0..BOARD_FRAMES {
            let frame = self.board_frame(&board_to_camera)?;
            let corners = find_corners(frame.colour(), &CharucoSheet::SHEET)?;
            views.push(BoardView::new(&corners, &frame));
        }
        let seen = average(&views, &CharucoSheet::SHEET)?;
        Ok(pose_from_board(&seen, &INTRINSICS, &placement)?)
    }

    /// Renders a board with the camera's noise.
    fn board_frame(&mut self, board_to_camera: &Isometry3<f64>) -> Result<RgbdFrame, FrameError> {
        let mut scene = Scene::wall(SIZE[0] as usize, SIZE[1] as usize, INTRINSICS, 3.0);
        let images = (&mut scene.colour, &mut scene.depth);
        draw_board(images, &INTRINSICS, &CharucoSheet::SHEET, board_to_camera);
        for grey in scene.colour.channels_mut() {
            let noisy = f64::from(*grey) + ERRORS.grey * normal(self.random);
            *grey = noisy.round().clamp(0.0, 255.0) as u8;
        }
        for raw in scene.depth.pixels_mut() {
            let z = f64::from(*raw) / INTRINSICS.depth_scale;
            let noisy = z * self.depth_scale + self.depth_noise(z, 0.0);
            *raw = (noisy * INTRINSICS.depth_scale).round() as u16;
        }
        scene.frame(0.0)
    }

    /// Calibrates with pixels that a person chooses and a measured height.
    fn motors(&mut self, motors: &PerMotor<Point3<f64>>) -> Result<Calibration, TrialError> {
        let seen = motors.map(|motor| {
            let p = self.true_pose.inverse_transform_point(&motor);
            let pixel = INTRINSICS.project(&p).unwrap_or_default();
            let click = vector(ERRORS.click_px, self.random);
            let depth = p.z * self.depth_scale + self.depth_noise(p.z, ERRORS.motor_m);
            SeenMotor { pixel: Point2::new(pixel.0 + click.x, pixel.1 + click.y), depth }
        });
        let height = motors[1].z + ERRORS.height_m * normal(self.random);
        Ok(pose_from_motors(&seen, &MotorMeasures::Height(height), &INTRINSICS)?)
    }

    /// Calibrates with places of the ball that are spread over the workspace.
    fn ball(&mut self, motors: &PerMotor<Point3<f64>>) -> Result<Calibration, TrialError> {
        let mut places = Vec::with_capacity(PLACES);
        for number in 0..PLACES {
            // Near each motor in turn, high and low.
            let weights = [0, 1, 2].map(|k| if k == number % 3 { 0.7 } else { 0.15 });
            let above: Vector3<f64> =
                motors.iter().zip(weights).map(|(motor, weight)| motor.coords * weight).sum();
            let below = if number < 3 { 0.15 } else { 0.4 } + 0.05 * self.random.random::<f64>();
            places.push(self.place(Point3::from(above - Vector3::z() * below)));
        }
        Ok(pose_from_places(&places)?)
    }

    /// Returns a place of the ball as a person measures it and the camera sees it.
    fn place(&mut self, place: Point3<f64>) -> BallPlace {
        let p = self.true_pose.inverse_transform_point(&place);
        let depth = p.z * self.depth_scale + self.depth_noise(p.z, 0.0);
        let (u, v) = INTRINSICS.project(&p).unwrap_or_default();
        let pixel = vector(ERRORS.ball_px, self.random);
        let mean = INTRINSICS.deproject(u + pixel.x, v + pixel.y, depth);
        let across = ERRORS.ball_px * p.z / INTRINSICS.fx;
        let along = ERRORS.depth_m * p.z * p.z;
        let sd = Vector3::new(across, across, along);
        let covariance = Matrix3::from_diagonal(&sd.component_mul(&sd));
        let known = place + vector(PLACE_SD_M, self.random);
        BallPlace { known, known_sd: PLACE_SD_M, seen: Gaussian3 { mean, covariance } }
    }
}
