//! How well an explanation fits the measured directions.

use nalgebra::Vector3;

use super::explanation::Explanation;
use super::sectors::Sectors;

/// Response of the ball to one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Column {
    /// Number of the output.
    pub output: usize,
    /// Displacement for a step that is to pay out, metres.
    pub per_step: Vector3<f64>,
    /// Standard deviation along one axis, metres.
    pub sd: f64,
}

/// Standard deviation of a direction apart from the camera's noise, as a sine: 7 degrees. It covers
/// the pose, the size by tape measure, and the curvature of the path.
const DIRECTION_SD: f64 = 0.122;

/// Standard deviation of the slope of a path, as a sine: 3 degrees. It covers a tilted pose.
const SLOPE_SD: f64 = 0.052;

/// Largest misfit of an explanation that is accepted, variances: three standard deviations in each
/// of three directions.
pub(super) const ACCEPTED: f64 = 27.0;

/// Returns the misfit of `explanation` in variances: 0 where every direction is possible.
pub(super) fn misfit(explanation: &Explanation, columns: &[Column], sectors: &Sectors) -> f64 {
    columns.iter().map(|column| column_misfit(explanation, column, sectors)).sum()
}

fn column_misfit(explanation: &Explanation, column: &Column, sectors: &Sectors) -> f64 {
    let moved = in_rig_frame(explanation, column);
    let sector = sectors.0[explanation.wiring.motors[column.output]];
    let horizontal = moved.xy().norm();
    let excess = sector.excess(moved.y.atan2(moved.x)).abs();
    let aside = if excess < std::f64::consts::FRAC_PI_2 { excess.sin() } else { 1.0 };
    let variances = |distance: f64, sine: f64| {
        distance.powi(2) / (column.sd.powi(2) + (sine * moved.norm()).powi(2))
    };
    variances(horizontal * aside, DIRECTION_SD) + variances(moved.z.max(0.0), SLOPE_SD)
}

/// Returns the mean turn about the vertical, radians, that the columns have beyond `explanation`.
pub(super) fn remaining_yaw(
    explanation: &Explanation,
    columns: &[Column],
    sectors: &Sectors,
) -> f64 {
    let excess = columns.iter().map(|column| {
        let moved = in_rig_frame(explanation, column);
        let sector = sectors.0[explanation.wiring.motors[column.output]];
        sector.excess(moved.y.atan2(moved.x))
    });
    let handedness = explanation.frame.matrix().fixed_view::<2, 2>(0, 0).determinant();
    handedness * excess.sum::<f64>() / columns.len().max(1) as f64
}

/// Returns the displacement of `column` for cable that is paid out, in the rig frame.
fn in_rig_frame(explanation: &Explanation, column: &Column) -> Vector3<f64> {
    let sign = if explanation.wiring.reversed[column.output] { -1.0 } else { 1.0 };
    explanation.frame.matrix().transpose() * column.per_step * sign
}
