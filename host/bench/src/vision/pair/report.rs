//! Result of the suite `pair`.

use std::fmt::{Display, Formatter, Result};

use serde::Serialize;

/// Result of the suite `pair`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairReport {
    /// Always `"pair"`.
    pub suite: &'static str,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of pictures of each camera in a case.
    pub frames: usize,
    /// Case by case.
    pub cases: Vec<CaseReport>,
    /// Turned cameras.
    pub knocks: KnockReport,
}

/// Result of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseReport {
    /// Its name.
    pub name: &'static str,
    /// Positions of the fuser.
    pub fused: ErrorReport,
    /// Positions of the newest two circles as if they were of one moment.
    pub newest: ErrorReport,
    /// 95th percentile of the jumps from a pair to an outline and back, millimetres; `None`
    /// without outlines.
    pub jump_p95_mm: Option<f64>,
    /// Median of the differences of the latencies that were found, milliseconds.
    pub latency_ms: Option<f64>,
    /// Runs with an alarm.
    pub alarms: usize,
}

/// Errors of positions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorReport {
    /// Number of positions.
    pub positions: usize,
    /// Median distance from the true place, millimetres.
    pub median_mm: f64,
    /// Root mean square of it, millimetres.
    pub rms_mm: f64,
    /// 95th percentile of it, millimetres.
    pub p95_mm: f64,
    /// 99th percentile of it, millimetres.
    pub p99_mm: f64,
    /// Mean of e'C⁻¹e: 3 where the covariance fits the errors.
    pub consistency: f64,
}

/// Result of cameras that were turned by 1 degree, and of cameras that stand still.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct KnockReport {
    /// Number of turned cameras.
    pub knocks: usize,
    /// Number of those that move the pairs by more than 20 mm.
    pub harmful: usize,
    /// Number of those that raise an alarm within 1 s.
    pub told: usize,
    /// Number of those alarms that name the camera.
    pub named: usize,
    /// Number of those that name the other one.
    pub misnamed: usize,
    /// Duration with cameras that stand still, hours.
    pub quiet_hours: f64,
    /// Alarms without a turned camera.
    pub false_alarms: usize,
}

impl Display for PairReport {
    /// Writes a table with a row for each case, and a line about the alarms.
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let heads = ["fused, median/rms/p95/p99 mm", "e²/C", "newest pair, the same", "e²/C"];
        let [fused, fit, newest, _] = heads;
        writeln!(f, "{:27}| {fused:>29} {fit:>6} | {newest:>29} {fit:>6} | jump p95", "case")?;
        for case in &self.cases {
            let jump = case.jump_p95_mm.map_or_else(String::new, |it| format!("{it:.1} mm"));
            let [fused, newest] = [&case.fused, &case.newest].map(cells);
            write!(f, "{:27}| {fused} | {newest} | {jump}", case.name)?;
            if let Some(latency) = case.latency_ms {
                write!(f, " latency {latency:.1} ms")?;
            }
            if case.alarms > 0 {
                write!(f, " {} ALARMS", case.alarms)?;
            }
            writeln!(f)?;
        }
        let KnockReport { knocks, harmful, told, named, misnamed, quiet_hours, false_alarms } =
            self.knocks;
        write!(
            f,
            "turned by 1°: {knocks}, {harmful} by more than 20 mm: {told} told within 1 s, \
             {named} by name, {misnamed} wrongly; {false_alarms} false alarms, \
             {quiet_hours:.2} h without a knock"
        )
    }
}

/// Returns the cells of a method.
fn cells(errors: &ErrorReport) -> String {
    let ErrorReport { median_mm, rms_mm, p95_mm, p99_mm, consistency, .. } = errors;
    let errors = format!("{median_mm:.2}/{rms_mm:.2}/{p95_mm:.2}/{p99_mm:.2}");
    format!("{errors:>29} {consistency:>6.2}")
}
