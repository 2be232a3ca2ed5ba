//! Calibrations of many rigs.

use std::fmt;

use plumb_calibrate::calibration::Grade;
use serde::Serialize;

use super::trial::middle;
use super::{CalibrationWay, TrialError, trial};
use crate::control::{Suite, SuiteName};
use crate::run_id::RunId;

/// Errors of the poses that one way finds. Angles in degrees, lengths in metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// Name of the way.
    pub way: &'static str,
    /// Number of rigs.
    pub rigs: usize,
    /// Number of calibrations that were refused or poor and repeated.
    pub refused: u64,
    /// Number of results of the grade good.
    pub good: usize,
    /// Angle between the found and the true direction: median, 95 %, largest.
    pub rotation_deg: [f64; 3],
    /// Error of a measured position in the middle of the rig: median, 95 %, largest.
    pub position_m: [f64; 3],
    /// Error on held-out samples: median, 95 %, largest; `None` where none can be held out.
    pub held_out_m: Option<[f64; 3]>,
}

impl Survey {
    /// Heading of the table.
    pub const HEADING: &'static str = concat!(
        "way      rigs  refused  good   rotation, degrees    position, mm       held-out, mm\n",
        "                              median  95 %   max  median  95 %   max  median  95 %   max",
    );
}

/// Calibrates the cameras of rigs with the numbers from 0. Calls `progress` with the number of rigs
/// that are done after each one.
///
/// # Errors
/// If a rig is invalid, or the calibrations of one camera fail too often.
pub fn survey(
    way: CalibrationWay,
    rigs: u64,
    seed: u64,
    mut progress: impl FnMut(u64),
) -> Result<Survey, TrialError> {
    let suite = Suite::new(SuiteName::QuasiStatic);
    let (mut rotations, mut positions, mut held_out) = (Vec::new(), Vec::new(), Vec::new());
    let (mut refused, mut good) = (0, 0);
    for rig in 0..rigs {
        let id = RunId { seed, rig };
        let task = suite.task(id)?;
        let trial = trial(way, &task, id)?;
        let middle = middle(task.geometry.motors());
        rotations.push(trial.rotation_error().to_degrees());
        positions.push((trial.measured(&middle) - middle).norm());
        held_out.extend(trial.found.held_out());
        refused += trial.refused;
        good += usize::from(trial.found.grade() == Grade::Good);
        progress(rig + 1);
    }
    Ok(Survey {
        way: way.as_str(),
        rigs: positions.len(),
        refused,
        good,
        rotation_deg: quantiles(rotations).unwrap_or_default(),
        position_m: quantiles(positions).unwrap_or_default(),
        held_out_m: quantiles(held_out),
    })
}

/// Returns median, 95 % quantile and largest value; `None` of no values.
fn quantiles(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = |share: f64| values[(share * last as f64).round() as usize];
    Some([at(0.5), at(0.95), at(1.0)])
}

impl fmt::Display for Survey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { way, rigs, refused, good, .. } = self;
        let [median, most, max] = self.rotation_deg;
        write!(f, "{way:7} {rigs:5} {refused:8} {good:5}  {median:6.2} {most:5.2} {max:5.2}")?;
        let [median, most, max] = self.position_m.map(|it| it * 1e3);
        write!(f, "  {median:6.1} {most:5.1} {max:5.1}")?;
        match self.held_out_m.map(|it| it.map(|it| it * 1e3)) {
            Some([median, most, max]) => write!(f, "  {median:6.1} {most:5.1} {max:5.1}"),
            None => write!(f, "  none"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_way_finds_the_direction_of_a_few_cameras() {
        for way in CalibrationWay::ALL {
            let mut done = Vec::new();
            let survey = survey(way, 6, 1, |rigs| done.push(rigs)).unwrap();
            assert_eq!(done, [1, 2, 3, 4, 5, 6]);
            assert!(survey.rotation_deg[2] < 4.0, "{survey}");
            assert!(survey.position_m[2] < 0.04, "{survey}");
        }
    }

    #[test]
    fn quantiles_are_those_of_the_sorted_values() {
        let values = (0..=100).rev().map(f64::from).collect();
        assert_eq!(quantiles(values), Some([50.0, 95.0, 100.0]));
        assert_eq!(quantiles(Vec::new()), None);
    }
}
