//! Statistics over all runs of a controller at one speed.

use std::fmt;

use serde::Serialize;

use super::super::report::{MIN_SLACK_S, quantile, round};
use super::PathSuite;
use super::deviation::Deviations;
use super::simulate::{Loss, Outcome};
use crate::run_id::RunId;

/// Median and 90th percentile over the runs of a measure. Lost runs count as infinite (`null` in
/// JSON).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub median: f64,
    /// 90th percentile.
    pub p90: f64,
}

/// A run of one rig.
pub(super) struct Run {
    /// Number of the rig.
    pub(super) rig: u64,
    /// Name of the shape.
    pub(super) shape: &'static str,
    /// Result.
    pub(super) outcome: Outcome,
}

/// Result of one controller at one speed on the shapes of a suite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathReport {
    /// Name of the controller.
    pub law: String,
    /// Name of the suite.
    pub suite: &'static str,
    /// Speed along the path, m/s.
    pub speed_m_s: f64,
    /// Number of rigs.
    pub rigs: u64,
    /// Number of runs: each rig has several shapes.
    pub runs: usize,
    /// Seed of the rigs.
    pub seed: u64,
    /// Root mean square of a run's distance from the reference, millimetres.
    pub rms_mm: Quantiles,
    /// 99 % quantile of a run's distance from the reference, millimetres.
    pub p99_mm: Quantiles,
    /// Root mean square of a run's distance from the nearest place of the path, millimetres.
    pub cross_mm: Quantiles,
    /// Share of the runs with a cable slack for more than 20 ms.
    pub slack: f64,
    /// Path's time over real time, mean over the runs that were not lost.
    pub kept: f64,
    /// Number of lost runs: a fault, or more than 5 cm from the reference.
    pub lost: usize,
    /// Rig, shape and reason of each lost run.
    #[serde(skip)]
    pub losses: Vec<(u64, &'static str, Loss)>,
}

impl PathReport {
    /// Summarises the runs of `rigs` rigs, from the first one on, at one speed.
    pub(super) fn new(
        law: String,
        suite: PathSuite,
        speed_m_s: f64,
        (first, rigs): (RunId, u64),
        runs: &[Run],
    ) -> Self {
        let quantiles = |measure: fn(&Deviations) -> f64| {
            let of = |run: &Run| run.outcome.deviations.map_or(f64::INFINITY, |it| measure(&it));
            let mut values: Vec<f64> = runs.iter().map(|run| 1e3 * of(run)).collect();
            values.sort_by(f64::total_cmp);
            let [median, p90] = [0.5, 0.9].map(|q| round(quantile(&values, q)));
            Quantiles { median, p90 }
        };
        let loss = |run: &Run| run.outcome.deviations.err().map(|why| (run.rig, run.shape, why));
        let losses: Vec<_> = runs.iter().filter_map(loss).collect();
        let slack = runs.iter().filter(|run| run.outcome.slack_s > MIN_SLACK_S).count();
        let kept: f64 =
            runs.iter().filter_map(|run| run.outcome.deviations.ok()).map(|it| it.kept).sum();
        Self {
            law,
            suite: suite.as_str(),
            speed_m_s,
            rigs,
            runs: runs.len(),
            seed: first.seed,
            rms_mm: quantiles(|it| it.rms_m),
            p99_mm: quantiles(|it| it.p99_m),
            cross_mm: quantiles(|it| it.cross_m),
            slack: round(slack as f64 / runs.len() as f64),
            kept: round(kept / (runs.len() - losses.len()) as f64),
            lost: losses.len(),
            losses,
        }
    }

    /// Heading of the lines that [`Display`](fmt::Display) writes.
    pub const HEADING: &'static str = "\
        law              suite         cm/s   runs   rms mm   90 %   99 % mm   90 %  \
        cross mm   90 %   slack   kept   lost";
}

impl fmt::Display for PathReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:16} {:12} {:5.0} {:6} {:8.2} {:6.2} {:9.2} {:6.2} {:9.2} {:6.2} {:7.4} {:6.3} {:6}",
            self.law,
            self.suite,
            self.speed_m_s * 1e2,
            self.runs,
            self.rms_mm.median,
            self.rms_mm.p90,
            self.p99_mm.median,
            self.p99_mm.p90,
            self.cross_mm.median,
            self.cross_mm.p90,
            self.slack,
            self.kept,
            self.lost
        )
    }
}
