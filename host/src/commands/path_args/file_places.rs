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
    /// Returns why `trajectory` through the places is not possible, for a person. Where it is too
    /// fast for a motor, the text says which speed is possible; where it is by the times of the
    /// file, where, and by how much.
    pub(super) fn explain(
        &self,
        error: &PathPlanError,
        trajectory: &Trajectory,
        rig: &Rig,
    ) -> String {
        if let (true, Rule::Other(rule @ MotionError::MotorRate { .. })) =
            (self.times.is_empty(), &error.rule)
        {
            let highest = PathPlan::highest_speed(trajectory, rig);
            let advice = match (highest * 1e3).floor() {
                millimetres if millimetres >= 1.0 => {
                    format!("choose a lower --speed, at most {} m/s", millimetres / 1e3)
                }
                _ => "choose a path that needs less of the motors".to_owned(),
            };
            return format!("{error}: {}; {advice}", rule.without_advice());
        }
        if is_place(error) {
            let remedies = match self.times.is_empty() {
                true => " or move them inwards",
                false => ", move them inwards, or give the fast parts more time",
            };
            return format!(
                "{}{error}: {}; the path swings out between the places of the file: add places \
                 there{remedies}",
                self.lines_of(error, trajectory),
                error.rule
            );
        }
        let has_times = !self.times.is_empty();
        let slower = has_times.then(|| self.slowdown(trajectory, rig)).flatten();
        let Some(slower) = slower else { return format!("{error}: {}", error.rule) };
        let text = match &error.rule {
            Rule::Other(rule) => format!("{error}: {}", rule.without_advice()),
            rule => format!("{error}: {rule}"),
        };
        let lines = self.lines_of(error, trajectory);
        let rounded = match self.is_fast_by_rounding(trajectory, rig) {
            true => "its times are rounded: with more digits, or ",
            false => "",
        };
        format!(
            "{lines}{text}; {rounded}with all its times {slower} times as long it is slow enough"
        )
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

/// Returns whether a path goes through a place where the ball cannot be.
pub(super) fn is_place(error: &PathPlanError) -> bool {
    matches!(error.rule, Rule::Other(MotionError::Workspace(_) | MotionError::Triangle))
}
