//! Checks of a run: what its link allows, and whether the report is true.

use std::time::Duration;

use super::{Leg, LinkRun, Outcome};

/// Distance from the target that counts as reached, m; from the paper's rig file.
const RADIUS_M: f64 = 0.010;
/// Consecutive frames within that distance; from the paper's rig file.
const FRAMES: u64 = 10;
/// Maximum time from a disturbance to the end of the run.
const CAUSE_WITHIN: Duration = Duration::from_secs(2);

/// Result of the checks of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Verdict {
    /// Number of targets reported as reached and truly reached.
    pub driven: usize,
    /// Targets reported as reached but not reached: each with its frames and error.
    pub false_reached: Vec<String>,
    /// All other violations.
    pub violations: Vec<String>,
    /// Time from the disturbance to the end of a run that ended early, s.
    pub cause_after_s: Option<f64>,
}

impl Verdict {
    /// Returns whether all checks passed.
    pub fn is_good(&self) -> bool {
        self.false_reached.is_empty() && self.violations.is_empty()
    }
}

/// Checks a run.
pub fn check_run(run: &LinkRun, outcome: &Outcome) -> Verdict {
    let reported_reached = outcome.legs.iter().enumerate().filter(|(_, leg)| leg.reported_reached);
    let (driven, not): (Vec<_>, Vec<_>) = reported_reached.partition(|(_, leg)| is_driven(leg));
    let false_reached = not.iter().map(|(index, leg)| {
        format!("target {}: {} frames, {:.1} mm", index + 1, leg.frames, leg.true_error_m * 1e3)
    });
    let mut verdict = Verdict {
        driven: driven.len(),
        false_reached: false_reached.collect(),
        ..Verdict::default()
    };
    let mut violations = Vec::new();
    let mut check = |right: bool, what: &dyn Fn() -> String| {
        if !right {
            violations.push(what());
        }
    };
    let (link, Outcome { cause, exit_code, .. }) = (&run.link, outcome);
    let reached = outcome.exit_code == 0;
    if reached {
        let all = outcome.legs.iter().filter(|leg| leg.reported_reached).count() == outcome.targets;
        check(all, &|| format!("exit code 0 with {} legs", outcome.legs.len()));
        let may_reach = !matches!(link.expected, super::Expected::Cause(_));
        check(may_reach, &|| "reached, although the link was interrupted".to_owned());
    } else {
        check(link.expected.allows(cause), &|| format!("exit code {exit_code}: {cause}"));
        if let Some(disturbed) = link.disturbed_at(run.seed) {
            let after = Duration::from_micros(outcome.ended_at.since(disturbed));
            check(after <= CAUSE_WITHIN, &|| {
                format!("reported after {:.1} s", after.as_secs_f64())
            });
            verdict.cause_after_s = Some(after.as_secs_f64());
        }
    }
    check(outcome.at_rest, &|| format!("the motors still turn after the run ({})", outcome.state));
    verdict.violations = violations;
    verdict
}

/// Returns whether a leg has enough frames and ended at its target.
fn is_driven(leg: &Leg) -> bool {
    leg.frames >= FRAMES && leg.true_error_m <= RADIUS_M
}
