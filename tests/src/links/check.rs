//! Whether a run did what its link allows, and told the truth.

use std::time::Duration;

use super::{Leg, Outcome, Run};

/// Distance within which the ball is at its target, m: the paper's rig file.
const RADIUS_M: f64 = 0.010;
/// Pictures in a row within that distance: the paper's rig file.
const FRAMES: u64 = 10;
/// Longest time from a disturbance to the end of the run.
const CAUSE_WITHIN: Duration = Duration::from_secs(2);

/// What is wrong with a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Verdict {
    /// Targets that were driven to: reported as reached, and truly so.
    pub driven: usize,
    /// Targets that are reported as reached but were not: each with its frames and error.
    pub false_reached: Vec<String>,
    /// Everything else that must not be.
    pub wrong: Vec<String>,
    /// From the disturbance to the end of a run that ended early, s.
    pub cause_after_s: Option<f64>,
}

impl Verdict {
    /// Whether nothing is wrong.
    pub fn is_good(&self) -> bool {
        self.false_reached.is_empty() && self.wrong.is_empty()
    }
}

/// Judges a run.
pub fn check_run(run: &Run, outcome: &Outcome) -> Verdict {
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
    let mut wrong = Vec::new();
    let mut check = |right: bool, what: &dyn Fn() -> String| {
        if !right {
            wrong.push(what());
        }
    };
    let (link, Outcome { cause, exit_code, .. }) = (&run.link, outcome);
    let reached = outcome.exit_code == 0;
    if reached {
        let all = outcome.legs.iter().filter(|leg| leg.reported_reached).count() == outcome.targets;
        check(all, &|| format!("exit code 0 with {} legs", outcome.legs.len()));
        let may = !matches!(link.expected, super::Expected::Cause(_));
        check(may, &|| "reached, although the link was interrupted".to_owned());
    } else {
        check(link.expected.allows(cause), &|| format!("exit code {exit_code}: {cause}"));
        if let Some(disturbed) = link.disturbed_at(run.seed) {
            let after = Duration::from_micros(outcome.ended_at.since(disturbed));
            check(after <= CAUSE_WITHIN, &|| format!("told after {:.1} s", after.as_secs_f64()));
            verdict.cause_after_s = Some(after.as_secs_f64());
        }
    }
    check(outcome.at_rest, &|| format!("the motors still turn afterwards ({})", outcome.state));
    verdict.wrong = wrong;
    verdict
}

/// Whether a leg took the pictures that it must, and ended at its target.
fn is_driven(leg: &Leg) -> bool {
    leg.frames >= FRAMES && leg.true_error_m <= RADIUS_M
}
