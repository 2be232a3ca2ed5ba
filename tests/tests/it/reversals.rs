//! A target that is reversed on the way is no divergence, and a wrong wiring is found as soon as
//! without the allowance for run-outs (`tests/src/reversals.rs`). The binary `reversals` prints the
//! same as a table, with more seeds.

use plumb_runtime::rig::LawName;
use plumb_tests::bench::RATE_HZ;
use plumb_tests::parallel;
use plumb_tests::reversals::{Outcome, ReversalRun, Reversals, RigKind, Wiring};

/// Duration of a frame and a half, s: the board and the rule beside it may differ by a frame.
const FRAME_S: f64 = 1.5 / RATE_HZ as f64;

/// Executes runs with every rig and law, `seeds` of each.
fn outcomes(
    seeds: u64,
    wiring: impl Fn(u64) -> Wiring,
    reversals: impl Fn(u64) -> Reversals,
) -> Vec<(ReversalRun, Outcome)> {
    let mut runs = Vec::new();
    for rig in RigKind::ALL {
        for law in LawName::ALL {
            runs.extend((0..seeds).map(|seed| {
                let (wiring, reversals) = (wiring(seed), reversals(seed));
                ReversalRun { rig, law, wiring, reversals, seed }
            }));
        }
    }
    parallel::map(runs, parallel::processors(), |run| (run, run.execute()))
}

/// Returns the frame in which the run with this seed reverses its target once.
fn moment(seed: u64) -> u32 {
    5 + (seed * 7 % 40) as u32
}

/// Checks that no run has ended with an error that grows, where at least `least` would without the
/// allowance for run-outs.
fn assert_none_is_growing(runs: &[(ReversalRun, Outcome)], least: usize) {
    for (run, outcome) in runs {
        assert!(!outcome.is_growing(), "{run:?}: {outcome:?}");
    }
    let plain = runs.iter().filter(|(_, outcome)| outcome.plain_s.is_some()).count();
    assert!(plain >= least, "{plain} of {}", runs.len());
}

#[test]
fn a_target_that_is_reversed_in_the_first_move_is_no_divergence() {
    let runs = outcomes(20, |_| Wiring::RIGHT, |seed| Reversals::Once(moment(seed)));
    assert_none_is_growing(&runs, 30);
}

#[test]
fn a_target_behind_the_ball_of_a_path_is_no_divergence() {
    let runs = outcomes(40, |_| Wiring::RIGHT, |seed| Reversals::OnceOnPath(5 + moment(seed)));
    assert_none_is_growing(&runs, 4);
}

#[test]
fn a_target_behind_a_ball_that_stops_is_no_divergence() {
    let runs = outcomes(20, |_| Wiring::RIGHT, |seed| Reversals::OnceAfterStop(moment(seed)));
    assert_none_is_growing(&runs, 15);
}

#[test]
fn targets_that_are_reversed_again_and_again_are_no_divergence() {
    assert_none_is_growing(&outcomes(8, |_| Wiring::RIGHT, |_| Reversals::Often(3, 45)), 60);
    assert_none_is_growing(&outcomes(8, |_| Wiring::RIGHT, |_| Reversals::Often(1, 10)), 5);
}

/// Returns the wiring of the wrong ones for this seed.
fn wrong(seed: u64) -> Wiring {
    let wirings: Vec<Wiring> = Wiring::wrong().collect();
    wirings[seed as usize % wirings.len()]
}

#[test]
fn a_wrong_wiring_is_found_at_the_same_time_where_no_target_is_reversed() {
    let runs = outcomes(24, wrong, |_| Reversals::Never);
    for (run, outcome) in &runs {
        let plain_s = outcome.plain_s.filter(|_| outcome.is_growing());
        let is_same = plain_s.is_some_and(|plain_s| (outcome.after_s - plain_s).abs() <= FRAME_S);
        assert_eq!(outcome.is_growing(), is_same, "{run:?}: {outcome:?}");
        let is_late = outcome.plain_s.is_some_and(|plain_s| outcome.after_s > plain_s + FRAME_S);
        assert!(!is_late, "{run:?}: {outcome:?}");
    }
    let growing = runs.iter().filter(|(_, outcome)| outcome.is_growing()).count();
    assert!(growing * 4 > runs.len() * 3, "{growing} of {}", runs.len());
}

/// Without the allowance for run-outs some boards stop earlier, while the ball is in one: as they
/// do with the right wiring.
#[test]
fn a_wrong_wiring_is_found_soon_after_a_reversal() {
    let runs = outcomes(24, wrong, |seed| Reversals::Once(moment(seed)));
    let mut delays: Vec<f64> = runs
        .iter()
        .map(|(_, outcome)| outcome.after_s - outcome.plain_s.unwrap_or(outcome.after_s))
        .map(|delay| delay.max(0.0))
        .collect();
    delays.sort_by(f64::total_cmp);
    let quantile = |tenths: usize| delays[delays.len() * tenths / 10];
    assert!(quantile(8) <= FRAME_S, "{delays:?}");
    assert!(quantile(9) <= 1.5, "{delays:?}");
    let stopped = runs.iter().filter(|(_, outcome)| outcome.is_stopped()).count();
    assert!(stopped * 20 >= runs.len() * 19, "{stopped} of {}", runs.len());
}

/// The rigs that stay unnoticed keep the ball between the targets.
#[test]
fn targets_that_are_reversed_again_and_again_do_not_hide_a_wrong_wiring() {
    for reversals in [Reversals::Often(3, 45), Reversals::Often(1, 10)] {
        let runs = outcomes(12, wrong, |_| reversals);
        let stopped = runs.iter().filter(|(_, outcome)| outcome.is_stopped()).count();
        assert!(stopped * 20 >= runs.len() * 19, "{stopped} of {}", runs.len());
    }
}
