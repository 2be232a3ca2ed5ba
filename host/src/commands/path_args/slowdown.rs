//! The factor by which the times of a path's file must grow, where the path is too fast.

use plumb_path::trajectory::{Run, Sample, Trajectory};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::PathPlan;

use super::file_places::{FilePlaces, Place};

/// Margin of the factor: times of a file may be rounded to microseconds.
const MARGIN: f64 = 1.001;

/// Factors that are told, in one.
const FACTORS: f64 = 100.0;

/// Units, in a second, to which people round times.
const ROUNDINGS: [f64; 2] = [100.0, 1000.0];

/// Number of times that a factor is tried and made larger.
const MOST_TRIALS: u32 = 10;

impl FilePlaces {
    /// Returns the factor by which the times of the file must grow, in hundredths; `None` where
    /// they need not, or none is found. It was tried with the times that a person writes then.
    pub(super) fn slowdown(&self, trajectory: &Trajectory, rig: &Rig) -> Option<f64> {
        let in_hundredths = |factor: f64| (factor * FACTORS).ceil() / FACTORS;
        let needed = PathPlan::slowdown(trajectory, rig);
        if needed <= 1.0 {
            return None;
        }
        let mut factor = in_hundredths(needed * MARGIN);
        for _ in 0..MOST_TRIALS {
            let slower = self.slower_times(factor);
            let mut needed = slower.iter().map(|times| self.needed(times, trajectory, rig));
            let more = needed.try_fold(1.0, |most: f64, more| Some(most.max(more?)))?;
            if more <= 1.0 {
                return Some(factor);
            }
            factor = in_hundredths(factor * more);
        }
        None
    }

    /// Returns the factor by which `times` of the places must grow, 1 where they need not; `None`
    /// where they give no path like `trajectory`.
    fn needed(&self, times: &[f64], trajectory: &Trajectory, rig: &Rig) -> Option<f64> {
        let run = if trajectory.is_loop() { Run::Loop } else { Run::Once };
        let samples = self.places.iter().zip(times);
        let sample =
            |((_, position), time): (&Place, &f64)| Sample { time: *time, position: *position };
        let samples: Vec<Sample> = samples.map(sample).collect();
        Some(PathPlan::slowdown(&Trajectory::through_samples(&samples, run).ok()?, rig))
    }

    /// Returns the times of the file, `factor` times as long, as a person may write them: as they
    /// are, and where the file's times are rounded, rounded alike; of a steady rate also from its
    /// exact times.
    fn slower_times(&self, factor: f64) -> Vec<Vec<f64>> {
        let slower = |times: &[f64]| times.iter().map(|time| time * factor).collect();
        let exact: Vec<f64> = slower(&self.times);
        let Some(unit) = rounding(&self.times) else { return vec![exact] };
        let rounded =
            |times: &[f64]| times.iter().map(|time| (time * unit).round() / unit).collect();
        let steady = self.steady_times().map(|steady| rounded(&slower(&steady)));
        [rounded(&exact), exact].into_iter().chain(steady).collect()
    }

    /// Returns the exact times where those of the file are rounded and have a steady rate.
    fn steady_times(&self) -> Option<Vec<f64>> {
        let unit = rounding(&self.times)?;
        let (first, last) = (self.times.first()?, self.times.last()?);
        let step = (last - first) / (self.times.len() - 1).max(1) as f64;
        let steady: Vec<f64> = (0..self.times.len()).map(|i| first + step * i as f64).collect();
        let is_near = |(exact, time): (&f64, &f64)| (exact - time).abs() * unit < 1.0;
        steady.iter().zip(&self.times).all(is_near).then_some(steady)
    }

    /// Returns whether the path is too fast only because its times are rounded.
    pub(super) fn is_fast_by_rounding(&self, trajectory: &Trajectory, rig: &Rig) -> bool {
        let needed = self.steady_times().and_then(|it| self.needed(&it, trajectory, rig));
        needed.is_some_and(|needed| needed <= 1.0)
    }
}

/// Returns the unit to which all times are rounded, in a second; `None` where they are not.
fn rounding(times: &[f64]) -> Option<f64> {
    let is_whole = |time: &f64, unit: f64| {
        let units = time * unit;
        (units - units.round()).abs() < 1e-6
    };
    ROUNDINGS.into_iter().find(|unit| times.iter().all(|time| is_whole(time, *unit)))
}
