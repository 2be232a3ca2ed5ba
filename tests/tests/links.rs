//! The real session, drive and link over every link of the table, with every law and three targets:
//! a target that is reported as reached was driven to, a run that ends early tells the true cause
//! within 2 s, and the board stands still afterwards. `make links` prints the same as a table, and
//! takes more seeds.

use plumb_tests::links::{Outcome, Run, check_run, in_real_time, in_virtual_time, link, links};

/// Seeds of each link and law, as `make links` has them.
const SEEDS: u64 = 20;

/// What is wrong with a run, in a line; `None` where nothing is.
fn wrong(run: &Run, in_time: fn(&Run) -> Outcome) -> Option<String> {
    let outcome = in_time(run);
    let verdict = check_run(run, &outcome);
    let what = [verdict.false_reached.clone(), verdict.wrong.clone()].concat().join("; ");
    (!verdict.is_good())
        .then(|| format!("{}, {}, seed {}: {what}", run.link.name, run.law, run.seed))
}

fn every_link(law: &'static str) {
    let runs =
        links().into_iter().flat_map(|link| (0..SEEDS).map(move |seed| Run { link, law, seed }));
    let wrong: Vec<String> = runs.filter_map(|run| wrong(&run, in_virtual_time)).collect();
    assert!(wrong.is_empty(), "{} runs:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn interval_tells_the_truth_over_every_link() {
    every_link("interval");
}

#[test]
fn sign_tells_the_truth_over_every_link() {
    every_link("sign");
}

#[test]
fn adaptive_tells_the_truth_over_every_link() {
    every_link("adaptive");
}

#[test]
fn taut_tells_the_truth_over_every_link() {
    every_link("taut");
}

/// In real time over a pseudo-terminal; no time is asserted.
fn over_a_terminal(name: &str) {
    let run = Run { link: link(name), law: "taut", seed: 1 };
    assert_eq!(wrong(&run, in_real_time), None);
}

#[test]
fn a_terminal_of_115200_baud_tells_the_truth() {
    over_a_terminal("115200 baud");
}

#[test]
fn a_terminal_of_one_millisecond_a_frame_tells_the_truth() {
    over_a_terminal("1 ms");
}

#[test]
fn a_terminal_that_loses_a_frame_in_ten_tells_the_truth() {
    over_a_terminal("10 % lost");
}
