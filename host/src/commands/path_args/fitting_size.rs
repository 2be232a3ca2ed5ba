//! The largest size of a shape with which it is within the workspace and the triangle.

use nalgebra::Vector3;
use plumb_path::shape::{LEAST_SIZE_M, Shape};
use plumb_path::trajectory::{MotionLimits, Run};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{PathPlan, PathPlanError};

use super::file_places::is_place;

/// Speed at which a path is checked in few moments, m/s.
const FAST_M_S: f64 = 0.5;

/// Number of sizes that are tried below one that fits a fast path.
const MOST_SMALLER: usize = 3;

/// Returns why a shape goes through a place where the ball cannot be, and which size is possible,
/// for a person.
pub(super) fn explain_place(
    error: &PathPlanError,
    shape: &Shape,
    motion: (&MotionLimits, Run),
    rig: &Rig,
) -> String {
    let centre = shape.centre;
    let at = format!("[{:.4}, {:.4}, {:.4}] m", centre.x, centre.y, centre.z);
    let advice = match largest_size(shape, motion, rig) {
        Some(size) => format!(
            "at this centre, {at}, a --size of at most {size} m is possible; or choose another \
             --centre"
        ),
        None => match rig.motion_rules().check(centre, Vector3::zeros()) {
            Err(_) => format!("its centre, {at}, is outside too: choose another --centre"),
            Ok(()) => format!("no size is possible at its centre, {at}: choose another --centre"),
        },
    };
    format!("{error}: {}; {advice}", error.rule)
}

/// Returns the largest size, whole millimetres in metres, with which the ball can be at every place
/// of a shape that is too large; `None` where none is possible.
fn largest_size(shape: &Shape, (limits, run): (&MotionLimits, Run), rig: &Rig) -> Option<f64> {
    let metres = |millimetres: u32| f64::from(millimetres) / 1e3;
    let fits = |millimetres: u32, limits: &MotionLimits| {
        let smaller = Shape { size: metres(millimetres), ..*shape };
        let plan = smaller.trajectory(limits, run).map(|path| PathPlan::new(path, true, rig));
        plan.is_ok_and(|plan| plan.err().is_none_or(|error| !is_place(&error)))
    };
    // A fast path has the same places, and is checked in few moments.
    let fast = MotionLimits { speed: limits.speed.max(FAST_M_S), ..*limits };
    // Workspace and triangle are convex: where a size fits, each smaller one does.
    let [least, given] = [LEAST_SIZE_M, shape.size].map(|size| (size * 1e3).ceil() as u32);
    let (mut largest, mut too_large) = (least - 1, given);
    while too_large - largest > 1 {
        let middle = u32::midpoint(largest, too_large);
        if fits(middle, &fast) {
            largest = middle;
        } else {
            too_large = middle;
        }
    }
    // The moments of the path itself may be nearer to its outermost place.
    let near = (least..=largest).rev().take(MOST_SMALLER);
    near.into_iter().find(|size| fits(*size, limits)).map(metres)
}
