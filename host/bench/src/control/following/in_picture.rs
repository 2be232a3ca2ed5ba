//! A circle in the picture of two cables: a rig of the suite `picture` after its two jogs.

use nalgebra::{Point3, center};
use plumb_emulator::plant::Task;
use plumb_path::shape::{Plane, Shape, ShapeKind};

use super::super::BenchError;
use super::super::controller::ControllerKind;
use super::super::eye::Stand;
use super::super::picture::{self, Jogged};
use super::super::suite::Suite;
use super::build;
use super::course::Course;
use super::simulate::{self, Loss, Outcome};
use crate::run_id::RunId;

/// Speeds along the circle, metres of the picture's frame a second.
pub(super) const SPEEDS_M_S: [f64; 2] = [0.05, 0.1];

/// Diameters of the circle, metres of the picture's frame: the largest with room counts.
const SIZES_M: [f64; 4] = [0.15, 0.12, 0.09, 0.06];
/// Places of the circle's centre: from the middle between the task's start and target (0) to the
/// middle between the motors, half their distance below them (1). The first with room counts.
const SHIFTS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Number of places at which the room is checked.
const CHECKED_PLACES: u32 = 60;
/// Distance from the motors and from their verticals, as a share of their distance: as in a rig
/// whose motors were clicked.
const MARGIN: f64 = 0.15;
/// Half of the picture's width and height less 3 %, pixels.
const HALF_PX: [f64; 2] = [0.47 * 640.0, 0.47 * 480.0];

/// Runs the circle of one rig. Returns an outcome for each speed, nothing for a rig without room.
pub(super) fn run_rig(
    controller: &ControllerKind,
    conditions: &Suite,
    id: RunId,
) -> Result<Vec<Vec<Outcome>>, BenchError> {
    let on_error = BenchError::of_rig(id);
    let task = conditions.task(id).map_err(on_error)?;
    let jogged = picture::jog(conditions, Stand::InFront, task, id).map_err(on_error)?;
    let Some(jogged) = jogged else {
        let refused = Outcome { deviations: Err(Loss::Refused), slack_s: 0.0 };
        return Ok(vec![vec![refused]; SPEEDS_M_S.len()]);
    };
    let Some(circle) = place(&jogged) else { return Ok(vec![Vec::new(); SPEEDS_M_S.len()]) };
    let mut controller = controller.clone();
    if let Some(law) = controller.settings_mut() {
        law.set_delay(jogged.measured.latency_s);
    }
    let run = |(number, speed_m_s): (u64, f64)| {
        let course = Course::new(&circle, speed_m_s).map_err(BenchError::of_rig(id))?;
        let start = jogged.view.true_position(course.start());
        let task = Task { start, target: start, ..jogged.task };
        let mut follower = build::follower(&controller, &jogged.suite, &course, &task, id)?;
        let view = Some(&jogged.view);
        let outcome =
            simulate::run(&mut *follower, &course, (&jogged.suite, view), &task, (id, number))?;
        Ok(vec![outcome])
    };
    (1..).zip(SPEEDS_M_S).map(run).collect()
}

/// Returns the largest circle in the room of a rig, in the frame of its picture.
fn place(jogged: &Jogged) -> Option<Shape> {
    let [a, b, _] = *jogged.task.geometry.motors();
    let from = center(&jogged.task.start, &jogged.task.target);
    let mut to = center(&a, &b);
    to.z -= 0.5 * (b - a).norm();
    let circle = |size, shift| Shape {
        kind: ShapeKind::Circle,
        centre: jogged.view.measured(0.0, from + (to - from) * shift),
        size,
        plane: Plane::Upright,
        tolerance: 0.0,
        seed: 0,
    };
    let sizes = SIZES_M.into_iter();
    let circles = sizes.flat_map(|size| SHIFTS.map(|shift| circle(size, shift)));
    circles.into_iter().find(|circle| {
        (0..CHECKED_PLACES).all(|k| {
            let (sin, cos) =
                (std::f64::consts::TAU * f64::from(k) / f64::from(CHECKED_PLACES)).sin_cos();
            let mut place = circle.centre;
            place.y += circle.size / 2.0 * cos;
            place.z += circle.size / 2.0 * sin;
            may_be(jogged, place)
        })
    })
}

/// Returns whether the ball may be at a place of the frame.
fn may_be(jogged: &Jogged, place: Point3<f64>) -> bool {
    let [a, b, _] = *jogged.task.geometry.motors();
    let truly = jogged.view.true_position(place);
    let margin = MARGIN * (b - a).norm();
    let pixel = jogged.view.eye.pixel(&truly);
    let (low, high) = (a.y.min(b.y), a.y.max(b.y));
    (low + margin..=high - margin).contains(&truly.y)
        && truly.z <= a.z.min(b.z) - margin
        && pixel.x.abs() <= HALF_PX[0]
        && pixel.y.abs() <= HALF_PX[1]
}
