//! Cameras of unknown place before rigs of two motors, and what breaks in their runs.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};
use plumb_emulator::plant::{Plant, RigError};
use plumb_protocol::MOTORS;
use plumb_runtime::rig::PictureFrame;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

named! {
    /// How a camera stands before the plane of the motors, in addition to ±30° about each axis.
    Stand:
    InFront "front" "in front";
    Mirrored "mirrored" "its picture mirrored";
    UpsideDown "upside-down" "upside down";
    Behind "behind" "behind the plane";
    Rolled60 "rolled60" "rolled by 60°";
    Rolled90 "rolled90" "rolled by 90°";
    Kept "kept" "in front, with the jogs of an earlier run, made where the target is";
}

named! {
    /// What breaks in the run of a rig in a picture.
    Defect:
    Stuck "stuck" "motor A stands, and its steps are counted";
    Caught "caught" "the ball is held where it is";
    Reversed "reversed" "motor A turns the wrong way";
    Knocked "knocked" "the camera is turned by 5° about a random axis";
}

/// Columns of a picture.
pub(super) const WIDTH_PX: f64 = 640.0;
/// Focal length, pixels: a field of view of 56°.
const FOCAL_PX: f64 = 600.0;
/// Largest angle of the camera about each axis, radians.
const TILT_RAD: f64 = std::f64::consts::FRAC_PI_6;
/// Time of the run from which a defect acts, seconds: in the middle of most drives.
const ONSET_S: f64 = 0.5;
/// Angle by which a camera is knocked, radians.
const KNOCK_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Rig that breaks at [`ONSET_S`].
pub(super) struct Broken {
    plant: Box<dyn Plant>,
    defect: Defect,
    time_s: f64,
    /// Turns of the motors at the onset, full steps.
    onset: [f64; MOTORS],
}

impl Broken {
    /// Returns `plant` with this defect.
    pub(super) fn new(plant: Box<dyn Plant>, defect: Defect) -> Self {
        Self { plant, defect, time_s: 0.0, onset: [0.0; MOTORS] }
    }
}

impl Plant for Broken {
    fn advance(&mut self, dt_s: f64, motors: [f64; MOTORS]) -> Result<(), RigError> {
        self.time_s += dt_s;
        if self.time_s < ONSET_S {
            self.onset = motors;
            return self.plant.advance(dt_s, motors);
        }
        let [a, b, c] = motors;
        let [at_onset, ..] = self.onset;
        match self.defect {
            Defect::Stuck => self.plant.advance(dt_s, [at_onset, b, c]),
            Defect::Reversed => self.plant.advance(dt_s, [2.0 * at_onset - a, b, c]),
            Defect::Knocked => self.plant.advance(dt_s, motors),
            Defect::Caught => Ok(()),
        }
    }

    fn ball(&self) -> Point3<f64> {
        self.plant.ball()
    }

    fn slack(&self) -> [bool; MOTORS] {
        self.plant.slack()
    }
}

/// A pinhole camera and the plane x = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Eye {
    /// From camera axes into the rig frame.
    pose: Isometry3<f64>,
    /// -1 where the picture is mirrored.
    sign: f64,
}

impl Eye {
    /// Returns a camera that looks at `middle` with a picture of `width` metres there.
    pub(super) fn new(middle: Point3<f64>, width: f64, stand: Stand, rng: &mut ChaCha8Rng) -> Self {
        let mut tilt = || TILT_RAD * rng.random_range(-1.0..=1.0);
        let (roll, pitch, yaw) = (tilt(), tilt(), tilt());
        let roll = roll
            + match stand {
                Stand::Rolled60 => 60_f64.to_radians(),
                Stand::Rolled90 => 90_f64.to_radians(),
                Stand::UpsideDown => 180_f64.to_radians(),
                Stand::InFront | Stand::Mirrored | Stand::Behind | Stand::Kept => 0.0,
            };
        // Camera axes of an upright camera that looks along -x: right is y, down is -z.
        let upright = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[
            Vector3::y(),
            -Vector3::z(),
            -Vector3::x(),
        ]));
        let turned = Rotation3::from_euler_angles(pitch, yaw, roll);
        let about = if stand == Stand::Behind { std::f64::consts::PI } else { 0.0 };
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), about) * upright * turned;
        let distance = width * FOCAL_PX / WIDTH_PX;
        let place = middle - rotation * Vector3::z() * distance;
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        let sign = if stand == Stand::Mirrored { -1.0 } else { 1.0 };
        Self { pose: Isometry3::from_parts(place.into(), rotation), sign }
    }

    /// Returns the camera turned by [`KNOCK_RAD`] about a random axis.
    pub(super) fn knocked(&self, rng: &mut ChaCha8Rng) -> Self {
        let axis = Vector3::from_fn(|_, _| rng.random_range(-1.0..=1.0)).normalize();
        let turn = UnitQuaternion::from_scaled_axis(axis * KNOCK_RAD);
        let rotation = self.pose.rotation * turn;
        Self { pose: Isometry3::from_parts(self.pose.translation, rotation), ..*self }
    }

    /// Returns where a point is seen, pixels from the middle of the picture.
    pub(super) fn pixel(&self, point: &Point3<f64>) -> Vector2<f64> {
        let seen = self.pose.inverse_transform_point(point);
        Vector2::new(self.sign * seen.x, seen.y) * (FOCAL_PX / seen.z)
    }

    /// Returns the point of the plane x = 0 that is seen at a pixel, metres.
    pub(super) fn point(&self, pixel: Vector2<f64>) -> Point3<f64> {
        let ray = Vector3::new(self.sign * pixel.x, pixel.y, FOCAL_PX);
        let (ray, from) = (self.pose.rotation * ray, self.pose.translation.vector);
        let point = from - ray * (from.x / ray.x);
        Point3::new(0.0, point.y, point.z)
    }
}

/// Map from true positions to those that the board gets.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PictureView {
    pub(super) eye: Eye,
    pub(super) frame: PictureFrame,
    /// The camera from [`ONSET_S`] on, where it is knocked.
    pub(super) knocked: Option<Eye>,
}

impl PictureView {
    /// Returns the measured position of a true one (metres) at a time of the run, seconds.
    pub(super) fn measured(&self, time_s: f64, point: Point3<f64>) -> Point3<f64> {
        let eye = self.knocked.as_ref().filter(|_| time_s >= ONSET_S).unwrap_or(&self.eye);
        let place = self.frame.place(eye.pixel(&point));
        Point3::new(0.0, place.x, place.y)
    }

    /// Returns the true position of a measured one, metres.
    pub(super) fn true_position(&self, point: Point3<f64>) -> Point3<f64> {
        self.eye.point(self.frame.turn.transpose() * point.coords.yz() / self.frame.scale)
    }
}
