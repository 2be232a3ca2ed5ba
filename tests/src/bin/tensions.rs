//! Table of how the tensions that the law `taut` estimates agree with those of elastic rigs.
//!
//! Usage: `tensions [RIGS]`. Each of the rigs (100 by default) is driven to its target and holds
//! the ball there, for 12 s, with stiff and with soft cables.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::process::ExitCode;

use plumb_emulator::plant::Population;
use plumb_tests::parallel;
use plumb_tests::tensions::{Agreement, Sample, TensionRun};

/// Stiffness of stiff and of soft cables, N/m.
const STIFFNESSES_N_M: [f64; 2] = [800.0, 150.0];
/// Parts of a run, s: begin and end.
const PARTS_S: [(f64, f64); 4] = [(0.0, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 12.0)];

fn main() -> ExitCode {
    let rigs = match std::env::args().nth(1).map(|word| word.parse()).transpose() {
        Ok(rigs) => rigs.unwrap_or(100),
        Err(error) => {
            eprintln!("tensions: {error}; usage: tensions [RIGS]");
            return ExitCode::from(2);
        }
    };
    println!(
        "| targets | N/m | time, s | samples | correlation | error, median | error, p90 \
         | near slack | of these rightly | truly so | slack | of these marked |"
    );
    println!("|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    for (targets, least_lambda) in [("population", 0.05), ("near an edge too", 0.005)] {
        for stiffness_n_m in STIFFNESSES_N_M {
            let population = Population { least_lambda, ..Population::default() };
            let run = |seed| TensionRun { population: population.clone(), stiffness_n_m, seed };
            let samples = execute(&(0..rigs).map(run).collect::<Vec<_>>());
            for (begin, end) in PARTS_S {
                let part = samples.iter().filter(|s| (begin..end).contains(&s.time_s));
                let part: Vec<Sample> = part.copied().collect();
                if !part.is_empty() {
                    let row = format_row(&Agreement::of(&part));
                    println!("| {targets} | {stiffness_n_m} | {begin} to {end} | {row} |");
                }
            }
        }
    }
    ExitCode::SUCCESS
}

/// Executes the runs on all processors. Returns the samples in their order.
fn execute(runs: &[TensionRun]) -> Vec<Sample> {
    let samples = parallel::map(runs, parallel::processors(), TensionRun::execute);
    samples.into_iter().flatten().collect()
}

fn format_row(agreement: &Agreement) -> String {
    let Agreement { samples, correlation, median_error, p90_error, .. } = agreement;
    let Agreement { marked, low, marked_low, slack, marked_slack, .. } = agreement;
    format!(
        "{samples} | {correlation:.2} | {median_error:.2} | {p90_error:.2} | {marked} \
         | {marked_low} | {low} | {slack} | {marked_slack}"
    )
}
