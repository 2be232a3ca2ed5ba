//! The real control loop and link over every link of the table, with every law and three targets. A
//! target reported as reached is reached, a run that ends early reports the true cause within 2 s,
//! and the board is at rest afterwards. `make links` prints the same as a table, with more seeds.

use plumb_runtime::rig::LawName;
use plumb_tests::links::{LinkRun, Outcome, check_run, in_real_time, in_virtual_time, link, links};

/// Seeds for each link and law; the default of `make links`.
const SEEDS: u64 = 20;

/// Executes a run and returns its violations, in a line; `None` if there are none.
fn violations(run: &LinkRun, execute: fn(&LinkRun) -> Outcome) -> Option<String> {
    let outcome = execute(run);
    let verdict = check_run(run, &outcome);
    let what = [verdict.false_reached.clone(), verdict.violations.clone()].concat().join("; ");
    (!verdict.is_good())
        .then(|| format!("{}, {}, seed {}: {what}", run.link.name, run.law, run.seed))
}

fn every_link(law: LawName) {
    let runs = links()
        .into_iter()
        .flat_map(|link| (0..SEEDS).map(move |seed| LinkRun { link, law, seed }));
    let failed: Vec<String> = runs.filter_map(|run| violations(&run, in_virtual_time)).collect();
    assert!(failed.is_empty(), "{} runs:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn interval_is_correct_over_every_link() {
    every_link(LawName::Interval);
}

#[test]
fn sign_is_correct_over_every_link() {
    every_link(LawName::Sign);
}

#[test]
fn adaptive_is_correct_over_every_link() {
    every_link(LawName::Adaptive);
}

#[test]
fn taut_is_correct_over_every_link() {
    every_link(LawName::Taut);
}

/// Checks a run in real time over a pseudo-terminal. No wall-clock time is checked.
fn over_a_terminal(name: &str) {
    let run = LinkRun { link: link(name), law: LawName::Taut, seed: 1 };
    assert_eq!(violations(&run, in_real_time), None);
}

#[test]
fn a_terminal_of_115200_baud_is_correct() {
    over_a_terminal("115200 baud");
}

#[test]
fn a_terminal_of_one_millisecond_a_frame_is_correct() {
    over_a_terminal("1 ms");
}

#[test]
fn a_terminal_that_loses_a_frame_in_ten_is_correct() {
    over_a_terminal("10 % lost");
}
