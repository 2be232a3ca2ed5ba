//! The places of a path's file, and what is wrong with a path through them.

use nalgebra::{Point3, Vector3};
use plumb_path::check::Rule;
use plumb_path::trajectory::Trajectory;
use plumb_runtime::rig::{MotionError, MotionRules, Rig};
use plumb_runtime::run::{PathPlan, PathPlanError};

/// Factor by which places in millimetres are too large where their G-code says G20, inches.
const MILLIMETRES_IN_AN_INCH: f64 = 25.4;

/// Place of a file, metres, with its line, from 1.
pub(super) type Place = (u64, Point3<f64>);

/// Places of the file of a path; none of a shape.
#[derive(Default)]
pub(super) struct FilePlaces {
    pub(super) places: Vec<Place>,
    /// Their times, seconds; none where the file has no times.
    pub(super) times: Vec<f64>,
    /// Whether the file says that they are in inches.
    pub(super) is_in_inches: bool,
}

impl FilePlaces {
    /// Returns why `trajectory` through the places is not possible. Where it is too fast, the text
    /// says which speed is possible, or by which factor the times of the file must grow.
    pub(super) fn explain(
        &self,
        error: &PathPlanError,
        trajectory: &Trajectory,
        rig: &Rig,
    ) -> String {
        let why = format!("{}{error}: {}", self.lines_of(error, trajectory), error.rule);
        match error.rule {
            Rule::Other(MotionError::Workspace(_) | MotionError::Triangle) => why,
            _ if !self.times.is_empty() => {
                let factor = PathPlan::slowdown(trajectory, rig);
                format!("{why}; all times must be {:.2} times as long", factor + 0.005)
            }
            Rule::Other(MotionError::MotorRate { .. }) => {
                let highest = (PathPlan::highest_speed(trajectory, rig) * 1e3).floor() / 1e3;
                format!("{why}; --speed must be at most {highest} m/s")
            }
            _ => why,
        }
    }

    /// Returns the lines of the file between which `trajectory` is not possible, as the begin of a
    /// sentence; nothing where the file has no times, or of a loop.
    fn lines_of(&self, error: &PathPlanError, trajectory: &Trajectory) -> String {
        let lines = self.lines_at(error.time_s).filter(|_| !trajectory.is_loop());
        lines.map(|[from, to]| format!("from line {from} to line {to}, ")).unwrap_or_default()
    }

    /// Returns the line of the first place that `rules` do not allow, and the place with its broken
    /// rule.
    pub(super) fn first_wrong(&self, rules: &MotionRules) -> Option<(u64, String)> {
        self.places.iter().find_map(|(line, place)| {
            let error = rules.check(*place, Vector3::zeros()).err()?;
            let in_millimetres = *place / MILLIMETRES_IN_AN_INCH;
            let is_millimetres = self.is_in_inches
                && error.other_unit().is_none()
                && rules.check(in_millimetres, Vector3::zeros()).is_ok();
            let unit = if is_millimetres { "; is it in millimetres (G21)?" } else { "" };
            let at = <[f64; 3]>::from(*place);
            Some((*line, format!("[{:.4}, {:.4}, {:.4}] m: {error}{unit}", at[0], at[1], at[2])))
        })
    }

    /// Returns the lines of the places before and after a time, seconds after the first.
    fn lines_at(&self, time_s: f64) -> Option<[u64; 2]> {
        let begin = self.times.first()?;
        let next = self.times.partition_point(|time| time - begin <= time_s);
        let next = next.clamp(1, self.places.len().checked_sub(1)?);
        Some([self.places[next - 1].0, self.places[next].0])
    }
}
