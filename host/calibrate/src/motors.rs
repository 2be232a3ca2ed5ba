//! Pose from the three motors: their pixels and depths.
//!
//! The rig frame is defined by the motors: z is up, across the plane of the three, y points from B
//! to A, and C has the smallest x. So their directions follow from the three points alone, if the
//! motors are at one height. Only the origin is a choice: it is below C in x, below B in y, and so
//! far below the motors as the user says. A user who has measured the motors' places in another
//! frame gives these instead.

use nalgebra::{
    DVector, Isometry3, Matrix3, Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector3,
};
use plumb_frame::camera::Intrinsics;
use plumb_frame::frame::RgbdFrame;
use plumb_protocol::{MOTORS, PerMotor};

use crate::calibration::{Calibration, CalibrationError, Sample};
use crate::depth::{depth_near, depth_sd};
use crate::least_squares::{Minimum, minimise};
use crate::rigid::{self, Handedness};

/// Letters of the motors.
pub const LETTERS: PerMotor<char> = ['A', 'B', 'C'];
/// Standard deviation of a pixel that a person chose, pixels.
const PIXEL_SD: f64 = 1.5;
/// Standard deviation of the depth of a motor's surface against its measured point, metres: where
/// on the pulley the depth was read.
const SURFACE_SD_M: f64 = 0.005;
/// Radius of the square from which the depth is taken, pixels.
const DEPTH_RADIUS: i32 = 2;
/// Least root mean square distance of the motors from a line, metres.
const MIN_OFF_LINE_M: f64 = 0.05;
/// Error of a side of the triangle that is reported, metres.
const SIDE_TOLERANCE_M: f64 = 0.02;

/// A motor as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenMotor {
    /// Column and row, pixels.
    pub pixel: Point2<f64>,
    /// Depth, metres.
    pub depth: f64,
}

/// What the user measured on the rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotorMeasures {
    /// Height of the motors above the origin, metres. The origin is below motor C in x and below
    /// motor B in y.
    Height(f64),
    /// Places of motors A, B, C in the rig frame, metres.
    Places(PerMotor<Point3<f64>>),
}

/// Returns the motors at three pixels (column and row of A, B, C), with the median of their depths
/// over the frames.
///
/// # Errors
/// If a motor has no depth.
pub fn see_motors(
    frames: &[RgbdFrame],
    pixels: PerMotor<Point2<f64>>,
) -> Result<PerMotor<SeenMotor>, CalibrationError> {
    let [a, b, c] = LETTERS;
    let [at_a, at_b, at_c] = pixels;
    Ok([see_motor(frames, a, at_a)?, see_motor(frames, b, at_b)?, see_motor(frames, c, at_c)?])
}

/// Returns the motor `letter` at a pixel (column and row), with the median of its depths over the
/// frames.
///
/// # Errors
/// If it has no depth, or is outside the pictures.
pub fn see_motor<'a>(
    frames: impl IntoIterator<Item = &'a RgbdFrame>,
    letter: char,
    pixel: Point2<f64>,
) -> Result<SeenMotor, CalibrationError> {
    let (mut depths, mut is_outside) = (Vec::new(), false);
    for frame in frames {
        let (width, height) = (frame.colour().width() as f64, frame.colour().height() as f64);
        is_outside |=
            !((-0.5..width - 0.5).contains(&pixel.x) && (-0.5..height - 0.5).contains(&pixel.y));
        depths.extend(depth_near(frame, &pixel, DEPTH_RADIUS));
    }
    depths.sort_by(f64::total_cmp);
    match depths.get(depths.len() / 2) {
        Some(&depth) => Ok(SeenMotor { pixel, depth }),
        None => {
            let pixel = [pixel.x, pixel.y];
            Err(CalibrationError::NoDepth { motor: letter, pixel, is_outside })
        }
    }
}

/// Returns the camera's pose from the motors.
///
/// # Errors
/// If the motors are on a line, or are not where their letters put them.
pub fn pose_from_motors(
    motors: &PerMotor<SeenMotor>,
    measures: &MotorMeasures,
    intrinsics: &Intrinsics,
) -> Result<Calibration, CalibrationError> {
    let seen = motors.map(|it| intrinsics.deproject(it.pixel.x, it.pixel.y, it.depth));
    let off = rigid::spread(&seen)[1];
    if off < MIN_OFF_LINE_M {
        let what = "the motors, as the camera sees them,";
        let advice = "Check the pixels first. If they are right, move at least one motor";
        return Err(CalibrationError::OnALine { what, advice, off, needed: 0.1 });
    }
    let own = from_frame_convention(&seen);
    check_letters(&seen, &own)?;
    let known = match measures {
        MotorMeasures::Height(height) => {
            let shift = Vector3::new(0.0, 0.0, *height);
            seen.map(|p| own * p + shift)
        }
        MotorMeasures::Places(places) => *places,
    };
    check_places(&known)?;
    let minimum =
        refined(motors, &seen, &known, intrinsics).ok_or(CalibrationError::Undetermined)?;
    let sample = |k: usize| Sample {
        name: format!("motor {}", LETTERS[k]),
        known: known[k],
        seen: seen[k],
        residual: (minimum.pose * seen[k] - known[k]).norm(),
        held_out: None,
        is_outlier: false,
    };
    Ok(Calibration {
        pose: minimum.pose,
        position_sd: minimum.position_sd(),
        rotation_sd: minimum.rotation_sd(),
        samples: (0..MOTORS).map(sample).collect(),
        findings: findings(&seen, &known, measures),
    })
}

/// Returns the pose that the convention of the rig frame gives, with the motors at height 0.
fn from_frame_convention([a, b, c]: &PerMotor<Point3<f64>>) -> Isometry3<f64> {
    let y = (a - b).normalize();
    // From C to the side BA, across it.
    let x = (b - c) - (b - c).dot(&y) * y;
    let x = x.normalize();
    let axes = Matrix3::from_rows(&[x.transpose(), y.transpose(), x.cross(&y).transpose()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let in_rig = |p: &Point3<f64>| rotation * p.coords;
    let origin = Vector3::new(in_rig(c).x, in_rig(b).y, in_rig(b).z);
    Isometry3::from_parts(Translation3::from(-origin), rotation)
}

/// Checks that z points up in the picture and that C is between B and A.
fn check_letters(
    seen: &PerMotor<Point3<f64>>,
    own: &Isometry3<f64>,
) -> Result<(), CalibrationError> {
    let [a, b, c] = seen.map(|p| own * p);
    // The camera's y axis points down.
    let down = own.rotation * Vector3::y();
    let reason = if down.z > 0.0 {
        "the frame that A, B and C give has its z axis pointing down in the picture"
    } else if !(b.y < c.y && c.y < a.y) {
        "motor C is not between A and B, seen along the line from B to A"
    } else {
        return Ok(());
    };
    Err(CalibrationError::Letters { reason })
}

/// Checks measured places against the convention of the rig frame.
fn check_places([a, b, c]: &PerMotor<Point3<f64>>) -> Result<(), CalibrationError> {
    let reason = if a.y <= b.y {
        "the measured place of motor A has not the larger y of A and B"
    } else if c.x >= a.x.min(b.x) {
        "the measured place of motor C has not the smallest x"
    } else {
        return Ok(());
    };
    Err(CalibrationError::Letters { reason })
}

/// Returns the pose with the least squares, weighted with the errors of pixels and depths.
fn refined(
    motors: &PerMotor<SeenMotor>,
    seen: &PerMotor<Point3<f64>>,
    known: &PerMotor<Point3<f64>>,
    intrinsics: &Intrinsics,
) -> Option<Minimum> {
    let pairs: PerMotor<_> = std::array::from_fn(|k| (seen[k], known[k]));
    let start = rigid::fit(&pairs, Handedness::Kept)?.isometry();
    let centre = rigid::centroid(seen.iter().copied());
    let to_centre = Translation3::from(centre);
    let mut minimum = minimise(start * to_centre, |pose| {
        let residuals: PerMotor<_> = std::array::from_fn(|k| {
            let difference =
                pose.inverse_transform_point(&known[k]).coords + centre.coords - seen[k].coords;
            let z = motors[k].depth;
            let across = Vector3::new(z / intrinsics.fx, z / intrinsics.fy, 0.0) * PIXEL_SD;
            let sd = across.map(|sd| sd.hypot(SURFACE_SD_M));
            let along = depth_sd(z).hypot(SURFACE_SD_M);
            // Along the ray the depth's error counts, across it the pixel's.
            let ray = seen[k].coords / seen[k].z;
            let off_ray = difference - ray * difference.z;
            [off_ray.x / sd.x, off_ray.y / sd.y, difference.z / along]
        });
        DVector::from_iterator(9, residuals.into_iter().flatten())
    })?;
    minimum.pose *= to_centre.inverse();
    Some(minimum)
}

/// Compares the triangle's sides, and says which errors three points cannot show.
fn findings(
    seen: &PerMotor<Point3<f64>>,
    known: &PerMotor<Point3<f64>>,
    measures: &MotorMeasures,
) -> Vec<String> {
    let mut findings = Vec::new();
    for (i, k) in [(0, 1), (1, 2), (2, 0)] {
        let (seen, known) = ((seen[i] - seen[k]).norm(), (known[i] - known[k]).norm());
        if (seen - known).abs() > SIDE_TOLERANCE_M {
            findings.push(format!(
                "from motor {} to motor {} the camera sees {seen:.3} m, but the measured places \
                 are {known:.3} m apart: measure again, or choose other pixels",
                LETTERS[i], LETTERS[k]
            ));
        }
    }
    findings.push(match measures {
        MotorMeasures::Height(_) => {
            let [ab, bc, ca] = [(0, 1), (1, 2), (2, 0)].map(|(i, k)| (known[i] - known[k]).norm());
            format!(
                "the camera sees the sides AB {ab:.3} m, BC {bc:.3} m, CA {ca:.3} m: compare them \
                 with a rule, for three points cannot be held out, and nothing else checks them"
            )
        }
        MotorMeasures::Places(_) => "three points cannot be held out: check the pose with a known \
                                     place of the ball (plumb calibrate --ball)"
            .to_owned(),
    });
    findings
}
