//! Waypoints, and the route of a run through them.

use plumb_protocol::units::Point;

use super::error::RunError;
use crate::rig::{MotionError, MotionRules, WrongTarget};
use crate::rounding::round;

/// Target of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Place of the ball, metres in the rig frame.
    pub target: [f64; 3],
    /// Time for which the board keeps the ball there, seconds; it may be infinite.
    pub dwell_s: f64,
    /// Distance within which the target counts as reached, metres; `None` for the rig file's.
    pub tolerance_m: Option<f64>,
}

impl Waypoint {
    /// Returns the waypoint of a target with the rig file's tolerance, and without a dwell time.
    pub fn new(target: [f64; 3]) -> Self {
        Self { target, dwell_s: 0.0, tolerance_m: None }
    }
}

/// Waypoint within the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CheckedWaypoint {
    /// The target in the board's units.
    pub(super) point: Point,
    /// The waypoint, with the target rounded to the board's unit.
    pub(super) waypoint: Waypoint,
}

/// Waypoints of a run.
#[derive(Debug, Clone)]
pub(super) struct Route {
    pub(super) waypoints: Vec<CheckedWaypoint>,
    /// Whether the first waypoint follows the last one.
    pub(super) is_repeated: bool,
}

impl Route {
    /// Checks the waypoints of a run.
    ///
    /// # Errors
    /// Where there are none, or one is outside the workspace or the triangle of the motors.
    pub(super) fn new(
        waypoints: &[Waypoint],
        is_repeated: bool,
        rules: &MotionRules,
    ) -> Result<Self, RunError> {
        if waypoints.is_empty() {
            return Err(RunError::NoTargets);
        }
        check(&rules.wrong_targets(waypoints.iter().map(|waypoint| waypoint.target)))?;
        let checked = |waypoint: &Waypoint| {
            let point = rules.target(waypoint.target).ok()?;
            let waypoint = Waypoint { target: point.to_metres(), ..*waypoint };
            Some(CheckedWaypoint { point, waypoint })
        };
        Ok(Self { waypoints: waypoints.iter().filter_map(checked).collect(), is_repeated })
    }
}

/// Returns the error of a run whose targets are wrong.
pub(super) fn check(wrong: &[WrongTarget]) -> Result<(), RunError> {
    if let Some(wrong) = wrong.iter().find(|wrong| wrong.error.is_of_the_rig()) {
        return Err(RunError::NoPlace(wrong.error));
    }
    let is_of_picture = |wrong: &&WrongTarget| matches!(wrong.error, MotionError::Picture { .. });
    if let Some(wrong) = wrong.iter().find(is_of_picture) {
        return Err(RunError::Picture(wrong.error));
    }
    let (mut outside, mut slack) = (Vec::new(), Vec::new());
    for WrongTarget { target, error, .. } in wrong {
        let target = target.map(|metres| round(metres, 1e6));
        match error {
            MotionError::Workspace(border) => outside.push((target, *border)),
            _ => slack.push(target),
        }
    }
    match (outside.is_empty(), slack.is_empty()) {
        (false, _) => Err(RunError::TargetsOutside(outside)),
        (true, false) => Err(RunError::TargetsSlack(slack)),
        (true, true) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;

    fn route_error(rig: &Rig, targets: &[[f64; 3]]) -> String {
        let targets: Vec<Waypoint> = targets.iter().copied().map(Waypoint::new).collect();
        Route::new(&targets, false, &rig.motion_rules()).err().unwrap().to_string()
    }

    #[test]
    fn a_target_outside_the_workspace_is_named_in_micrometres() {
        let rig = Rig { simulation: None, ..Rig::paper().unwrap() };
        let outside = Point::from_metres([0.4, -0.1, 0.3]).unwrap().to_metres();
        let error = route_error(&rig, &[outside]);
        assert!(error.contains("the target [0.4, -0.1, 0.3] m is"), "{error}");
        let error = route_error(&rig, &[[0.54, 0.22, 0.4], outside, [1.5; 3]]);
        assert!(error.contains("the targets [0.4, -0.1, 0.3], [1.5, 1.5, 1.5] m are"), "{error}");
    }

    #[test]
    fn a_rig_file_without_a_place_is_named_and_no_target() {
        let mut rig = Rig::paper().unwrap();
        rig.workspace.min[0] = rig.workspace.max[0];
        let error = route_error(&rig, &[[0.54, 0.22, 0.3], [0.54, 0.22, 0.4]]);
        assert!(
            error.starts_with("the workspace of the rig file has no room along x: "),
            "{error}"
        );
        let mut rig = Rig::paper().unwrap();
        let simulation = rig.simulation.as_mut().unwrap();
        simulation.motors[2] = simulation.motors[1];
        let error = route_error(&rig, &[[0.54, 0.22, 0.3], [0.54, 0.22, 0.4]]);
        assert!(error.starts_with("the motors are on a line, seen from above"), "{error}");
    }

    #[test]
    fn a_target_that_no_cables_can_hold_is_named() {
        let rig = Rig::paper().unwrap();
        let error = route_error(&rig, &[[0.54, 0.22, 0.3], [0.12, 0.45, 0.3]]);
        assert!(error.starts_with("the target [0.12, 0.45, 0.3] m is outside the tri"), "{error}");
        let unknown = Rig { simulation: None, ..rig };
        let target = Waypoint::new([0.12, 0.45, 0.3]);
        assert!(Route::new(&[target], false, &unknown.motion_rules()).is_ok());
    }
}
