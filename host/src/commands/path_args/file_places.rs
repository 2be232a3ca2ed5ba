//! The places of a path's file, and what is wrong with a path through them.

use nalgebra::{Point3, Vector3};
use plumb_path::check::Rule;
use plumb_path::trajectory::{Run, Sample, Trajectory};
use plumb_runtime::rig::{MotionError, MotionRules, Rig};
use plumb_runtime::run::{PathPlan, PathPlanError};

/// Factor by which places in millimetres are too large where their G-code says G20, inches.
const MILLIMETRES_IN_AN_INCH: f64 = 25.4;

/// Margin of the factor for the times of a file: a person rounds the times.
const MARGIN: f64 = 1.01;

/// Number of times that a factor is tried and made larger.
const MOST_TRIALS: u32 = 10;

/// Place of a file, metres, with its line, from 1.
type Place = (u64, Point3<f64>);

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
        if self.places.is_empty() && is_place(error) {
            return format!(
                "{error}: {}; choose a smaller --size, or another --centre",
                error.rule
            );
        }
        if is_place(error) {
            return format!(
                "{}{error}: {}; the path swings out between the places of the file: add places \
                 there, or move them inwards",
                self.lines_of(error, trajectory),
                error.rule
            );
        }
        let slower = self.slowdown(trajectory, rig);
        if self.times.is_empty() || slower <= 1.0 {
            return format!("{error}: {}", error.rule);
        }
        let text = match &error.rule {
            Rule::Other(rule) => format!("{error}: {}", rule.without_advice()),
            rule => format!("{error}: {rule}"),
        };
        format!(
            "{}{text}; with all its times {slower:.2} times as long it is slow enough",
            self.lines_of(error, trajectory)
        )
    }

    /// Returns the lines of the file between which `trajectory` is not possible, as the begin of a
    /// sentence; nothing where the file has no times, or of a loop.
    fn lines_of(&self, error: &PathPlanError, trajectory: &Trajectory) -> String {
        let lines = self.lines_at(error.time_s).filter(|_| !trajectory.is_loop());
        lines.map(|[from, to]| format!("from line {from} to line {to}, ")).unwrap_or_default()
    }

    /// Returns the factor by which the times of the file must grow, with [`MARGIN`]; at most 1
    /// where they need not. A slower path is looked at in more moments, which may need a larger
    /// factor.
    fn slowdown(&self, trajectory: &Trajectory, rig: &Rig) -> f64 {
        let mut factor = PathPlan::slowdown(trajectory, rig);
        let run = if trajectory.is_loop() { Run::Loop } else { Run::Once };
        for _ in 0..MOST_TRIALS {
            let samples: Vec<_> = self
                .places
                .iter()
                .zip(&self.times)
                .map(|((_, position), time)| Sample { time: time * factor, position: *position })
                .collect();
            let slower = Trajectory::through_samples(&samples, run);
            match slower.map(|slower| PathPlan::slowdown(&slower, rig)) {
                Ok(more) if more > 1.0 => factor *= more,
                _ => break,
            }
        }
        if factor > 1.0 { factor * MARGIN } else { factor }
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
fn is_place(error: &PathPlanError) -> bool {
    matches!(error.rule, Rule::Other(MotionError::Workspace(_) | MotionError::Triangle))
}
