//! The paths of the suites: shapes in the room that a rig has.

use nalgebra::{Point3, center};
use plumb_emulator::plant::Task;
use plumb_path::Trajectory;
use plumb_path::shape::{Plane, Shape, ShapeKind};
use plumb_path::trajectory::{Moment, MotionLimits, PathError, Run};
use plumb_protocol::message::{KNOTS, Knot, Reference};
use plumb_protocol::units::{Micros, Point, Speed};

use crate::run_id::RunId;

/// Shapes of a rig.
pub(super) const SHAPES: [ShapeKind; 4] =
    [ShapeKind::Circle, ShapeKind::Square, ShapeKind::Eight, ShapeKind::Spline];
/// Speeds along the shapes, m/s.
pub(super) const SPEEDS_M_S: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

/// Sizes of a shape, metres: the largest with room counts.
const SIZES_M: [f64; 8] = [0.2, 0.16, 0.12, 0.1, 0.08, 0.06, 0.04, 0.02];
/// Places of a shape's centre: from the middle between the task's start and target (0) to the
/// middle of the motors (1). The first with room counts.
const SHIFTS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Least barycentric coordinate of a path.
const LEAST_LAMBDA: f64 = 0.05;
/// Least depth of a path below the lowest motor, metres.
const LEAST_DEPTH_M: f64 = 0.1;
/// Depth of a shape's centre beyond that, as a share of its size: a spline leaves its plane.
const HEADROOM: f64 = 0.3;
/// Number of places at which the room of a shape is checked.
const CHECKED_PLACES: u32 = 200;
/// Distance of a square's rounded corners from its corners, as a share of its side.
const CORNER_TOLERANCE: f64 = 0.05;

/// Highest acceleration, m/s²: a circle of 0.1 m radius at 0.2 m/s needs 0.4, and the crate
/// plumb-path gives 1/√2 of this to the centripetal acceleration.
const ACCELERATION_M_S2: f64 = 0.6;
/// Highest jerk, m/s³. The bends of a square with a side of 0.2 m begin within 0.1 s.
const JERK_M_S3: f64 = 6.0;

/// Zero of a path's time in messages, µs: the first knot is before the path's begin.
const ZERO_US: i64 = 10_000_000;
/// Time between two knots, µs.
const KNOT_INTERVAL_US: i64 = 150_000;

/// Path of a run, and how the reference goes along it.
pub(super) struct Course {
    trajectory: Trajectory,
}

impl Course {
    /// Creates the course along a shape at a speed, m/s, round and round.
    ///
    /// # Errors
    /// If a number of the shape or the speed is not above 0.
    pub(super) fn new(shape: &Shape, speed_m_s: f64) -> Result<Self, PathError> {
        let limits =
            MotionLimits { speed: speed_m_s, acceleration: ACCELERATION_M_S2, jerk: JERK_M_S3 };
        Ok(Self { trajectory: shape.trajectory(&limits, Run::Loop)? })
    }

    /// Returns the reference at a time after the start, seconds. Before 0 it rests at the start.
    pub(super) fn at(&self, time_s: f64) -> Moment {
        self.trajectory.at(time_s)
    }

    /// Returns where the path begins, metres.
    pub(super) fn start(&self) -> Point3<f64> {
        self.at(0.0).position
    }

    /// Returns the message number `sequence` of a host whose path is at `time_s`; the path waits.
    /// `None` beyond the range of the protocol.
    pub(super) fn message(&self, sequence: u16, time_s: f64) -> Option<Reference> {
        let now = (time_s * 1e6).round() as i64;
        let first = now.div_euclid(KNOT_INTERVAL_US) * KNOT_INTERVAL_US;
        let mut knots = [Knot::default(); KNOTS];
        for (k, knot) in (0..).zip(&mut knots) {
            let moment = self.at((first + k * KNOT_INTERVAL_US) as f64 * 1e-6);
            let [x, y, z] = moment.velocity.into();
            let velocity = [Speed::from_si(x)?, Speed::from_si(y)?, Speed::from_si(z)?];
            *knot = Knot { position: Point::from_metres(moment.position.into())?, velocity };
        }
        Some(Reference {
            sequence,
            now: Micros((now + ZERO_US) as u64),
            waits: true,
            first: Micros((first + ZERO_US) as u64),
            interval_us: KNOT_INTERVAL_US as u32,
            knots,
        })
    }

    /// Returns a path's time of the protocol in seconds after the start.
    pub(super) fn seconds(time: Micros) -> f64 {
        (time.0 as i64 - ZERO_US) as f64 * 1e-6
    }
}

/// Returns a shape in the room of a task's rig; `None` where it has too little.
///
/// # Errors
/// None with the constants of this module.
pub(super) fn place(kind: ShapeKind, task: &Task, id: RunId) -> Result<Option<Shape>, PathError> {
    for size in SIZES_M {
        for shift in SHIFTS {
            let shape = Shape {
                kind,
                centre: centre(task, size, shift),
                size,
                plane: Plane::Level,
                tolerance: CORNER_TOLERANCE * size,
                seed: id.seed ^ id.rig.rotate_left(32),
            };
            if has_room(&shape, task)? {
                return Ok(Some(shape));
            }
        }
    }
    Ok(None)
}

/// Returns the centre of a shape of this size, metres, at this shift.
fn centre(task: &Task, size: f64, shift: f64) -> Point3<f64> {
    let [a, b, c] = *task.geometry.motors();
    let (from, to) =
        (center(&task.start, &task.target), Point3::from((a.coords + b.coords + c.coords) / 3.0));
    let mut centre = from + (to - from) * shift;
    centre.z = from.z.min(top_m(task) - HEADROOM * size);
    centre
}

/// Returns the greatest height of a path, metres.
fn top_m(task: &Task) -> f64 {
    let heights = task.geometry.motors().map(|motor| motor.z);
    heights.into_iter().fold(f64::INFINITY, f64::min) - LEAST_DEPTH_M
}

/// Returns whether the ball may be everywhere on a shape.
fn has_room(shape: &Shape, task: &Task) -> Result<bool, PathError> {
    let course = Course::new(shape, SPEEDS_M_S[0])?;
    let step_s = course.trajectory.span() / f64::from(CHECKED_PLACES);
    Ok((0..CHECKED_PLACES).all(|k| {
        let place = course.at(f64::from(k) * step_s).position;
        let lambda = task.geometry.barycentric(&place);
        place.z <= top_m(task) && lambda.iter().all(|l| *l >= LEAST_LAMBDA)
    }))
}
