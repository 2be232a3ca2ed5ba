//! Statistics over all runs of a controller.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::picture::JogQuality;
use super::simulate::{Outcome, RunEnd};
use super::suite::SuiteName;
use crate::run_id::RunId;

/// Least total slack time at which a run counts as slack, seconds.
pub(super) const MIN_SLACK_S: f64 = 0.020;

/// Result of one controller on one suite. Times are multiples of the oracle's time for the same
/// task.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Name of the controller.
    pub law: String,
    /// Name of the suite.
    pub suite: &'static str,
    /// Number of the target in each run, from 1.
    pub target: usize,
    /// Number of rigs.
    pub rigs: u64,
    /// Seed of the rigs.
    pub seed: u64,
    /// Share of the runs in which the ball arrived at its target and stayed.
    pub converged: f64,
    /// Median time to the threshold over the oracle's time; failed runs count as infinite (`null`
    /// in JSON).
    pub median: f64,
    /// 90th percentile of that ratio.
    pub p90: f64,
    /// 99th percentile of that ratio.
    pub p99: f64,
    /// Maximum of that ratio.
    pub max: f64,
    /// Median of the time to the threshold above the oracle's, seconds; infinite as above.
    pub lost_s: f64,
    /// 99th percentile of that time.
    pub lost_p99_s: f64,
    /// Median time from the arrival to the report of "reached", seconds.
    pub told_s: f64,
    /// 99th percentile of that time.
    pub told_p99_s: f64,
    /// Share of the runs with a cable slack for more than 20 ms.
    pub slack: f64,
    /// Mean distance from the target during the hold test, millimetres.
    pub hold_mean_mm: f64,
    /// 99th percentile of that distance, millimetres.
    pub hold_p99_mm: f64,
    /// Share of the runs that reported "reached" with the ball outside the threshold.
    pub false_reached: f64,
    /// Median time to the threshold, seconds.
    #[serde(skip)]
    pub median_s: f64,
    /// Number and end of each failed run.
    #[serde(skip)]
    pub failed: Vec<(u64, RunEnd)>,
    /// Faults with which boards gave up: name, number of runs, median time, seconds.
    #[serde(skip)]
    pub faults: Vec<(String, usize, f64)>,
    /// Number of runs that stopped for a lost position and were started again.
    #[serde(skip)]
    pub resumed: usize,
}

/// Returns the faults with which boards gave up, each with its number and its median time, seconds.
fn faults(runs: &[(Outcome, f64)]) -> Vec<(String, usize, f64)> {
    let mut times: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (fault, time) in runs.iter().filter_map(|(run, _)| run.fault) {
        times.entry(format!("{fault:?}")).or_default().push(time);
    }
    let median = |times: Vec<f64>| round(quantile(&sorted(times.into_iter()), 0.5));
    times.into_iter().map(|(name, times)| (name, times.len(), median(times))).collect()
}

/// Returns the `q` quantile (0 to 1) of `sorted` values; NaN if there are none.
pub(crate) fn quantile<T: Copy + Into<f64>>(sorted: &[T], q: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    let at = (q * last as f64).round() as usize;
    sorted.get(at).map_or(f64::NAN, |&v| v.into())
}

/// Returns the values in ascending order.
fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Rounds to four decimal places, the resolution of a sample.
pub(super) fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

impl Report {
    /// Summarises the drives to the target of this number in runs of consecutive rigs, the first
    /// being `first`. Each comes with the oracle's time for it, seconds.
    pub(crate) fn new(
        (law, target): (String, usize),
        suite: SuiteName,
        first: RunId,
        runs: &[(Outcome, f64)],
    ) -> Self {
        let n = runs.len() as f64;
        let share = |count: usize| round(count as f64 / n);
        let ratios =
            runs.iter().map(|(run, oracle)| run.time_s.map_or(f64::INFINITY, |t| t / oracle));
        let ratios = sorted(ratios);
        let times = sorted(runs.iter().map(|(run, _)| run.time_s.unwrap_or(f64::INFINITY)));
        let lost =
            runs.iter().map(|(run, oracle)| run.time_s.map_or(f64::INFINITY, |t| t - oracle));
        let lost = sorted(lost);
        let told = sorted(runs.iter().filter_map(|(run, _)| run.told_s));
        let mut hold: Vec<f32> =
            runs.iter().flat_map(|(run, _)| run.hold_m.iter().copied()).collect();
        hold.sort_by(f32::total_cmp);
        let failed = (first.rig..).zip(runs).filter(|(_, (run, _))| run.time_s.is_none());
        let failed: Vec<_> = failed.map(|(k, (run, _))| (k, run.end)).collect();
        Self {
            law,
            suite: suite.as_str(),
            target,
            rigs: runs.len() as u64,
            seed: first.seed,
            converged: share(runs.len() - failed.len()),
            median: round(quantile(&ratios, 0.5)),
            p90: round(quantile(&ratios, 0.9)),
            p99: round(quantile(&ratios, 0.99)),
            max: round(quantile(&ratios, 1.0)),
            lost_s: round(quantile(&lost, 0.5)),
            lost_p99_s: round(quantile(&lost, 0.99)),
            told_s: round(quantile(&told, 0.5)),
            told_p99_s: round(quantile(&told, 0.99)),
            slack: share(runs.iter().filter(|(run, _)| run.slack_s > MIN_SLACK_S).count()),
            hold_mean_mm: round(
                hold.iter().map(|h| f64::from(*h)).sum::<f64>() / hold.len() as f64 * 1e3,
            ),
            hold_p99_mm: round(quantile(&hold, 0.99) * 1e3),
            false_reached: share(runs.iter().filter(|(run, _)| run.false_reached).count()),
            median_s: quantile(&times, 0.5),
            failed,
            faults: faults(runs),
            resumed: runs.iter().filter(|(run, _)| run.resumed).count(),
        }
    }

    /// Heading of the lines that [`Display`](fmt::Display) writes.
    pub const HEADING: &'static str = "\
        law              suite        target   rigs converged  median    p90    p99    max  \
        slack  hold mm   p99 mm  false  median s   lost s  p99 s  told s  p99 s";
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:16} {:12} {:6} {:6} {:9.4} {:7.3} {:6.3} {:6.3} {:6.2} \
             {:6.4} {:8.2} {:8.2} {:6.4} {:9.3} {:8.3} {:6.3} {:7.3} {:6.3}",
            self.law,
            self.suite,
            self.target,
            self.rigs,
            self.converged,
            self.median,
            self.p90,
            self.p99,
            self.max,
            self.slack,
            self.hold_mean_mm,
            self.hold_p99_mm,
            self.false_reached,
            self.median_s,
            self.lost_s,
            self.lost_p99_s,
            self.told_s,
            self.told_p99_s
        )
    }
}

/// Errors of the jogs of all rigs of a suite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JogReport {
    /// Number of rigs.
    pub rigs: usize,
    /// Share of the rigs whose jogs gave a frame.
    pub measured: f64,
    /// Share of all rigs whose Jacobian is right within 20 % of its largest entry.
    pub within_20_percent: f64,
    /// 99th percentile of the ball's way by both jogs, pixels.
    pub moved_p99_px: f64,
    /// Median error of the latency, ms.
    pub latency_median_ms: f64,
    /// 90th percentile of that error, ms.
    pub latency_p90_ms: f64,
}

impl JogReport {
    /// Summarises the jogs of all rigs; `None` for those that were refused.
    pub(super) fn of(jogs: &[Option<JogQuality>]) -> Self {
        let done: Vec<JogQuality> = jogs.iter().flatten().copied().collect();
        let all = |value: fn(&JogQuality) -> f64| sorted(done.iter().map(value));
        let share = |count: usize| round(count as f64 / jogs.len() as f64);
        let (moved, latency) = (all(|jog| jog.moved_px), all(|jog| jog.latency_ms));
        Self {
            rigs: jogs.len(),
            measured: share(done.len()),
            within_20_percent: share(done.iter().filter(|jog| jog.jacobian <= 0.2).count()),
            moved_p99_px: round(quantile(&moved, 0.99)),
            latency_median_ms: round(quantile(&latency, 0.5)),
            latency_p90_ms: round(quantile(&latency, 0.9)),
        }
    }
}

impl fmt::Display for JogReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} rigs, jogs {:.4}; Jacobian within 20 % {:.4}; ball moved {:.1} px (p99); latency \
             off by {:.1} ms (median), {:.1} ms (p90)",
            self.rigs,
            self.measured,
            self.within_20_percent,
            self.moved_p99_px,
            self.latency_median_ms,
            self.latency_p90_ms
        )
    }
}
