//! Table of drives whose target is replaced on the way by one in the opposite direction, with every
//! law: on rigs with right wiring, which are not to be stopped, and on rigs with wrong wiring,
//! which are to be stopped as soon as without the allowance for run-outs. Exits with 1 if the
//! divergence guard stops a rig with right wiring.
//!
//! Usage: `reversals [--seeds N]`.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::process::ExitCode;

use plumb_runtime::rig::LawName;
use plumb_tests::parallel;
use plumb_tests::reversals::{Outcome, ReversalRun, Reversals, RigKind, Wiring};

const USAGE: &str = "[--seeds N]";

/// Reversals of the run with a seed.
type Kind = fn(u64) -> Reversals;

/// Frames of the first move in which targets are reversed once.
const MOMENTS: u64 = 45;

fn main() -> ExitCode {
    let seeds = match seeds(std::env::args().skip(1)) {
        Ok(seeds) => seeds,
        Err(error) => {
            eprintln!("reversals: {error}; usage: reversals {USAGE}");
            return ExitCode::from(2);
        }
    };
    println!(
        "| wiring | reversed | law | runs | ErrorGrowing | so without run-outs | stopped | seconds \
         from the reversal, median | 9 of 10 | so without run-outs | 9 of 10 | ball, m, worst |"
    );
    println!("|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    let mut is_good = true;
    for is_wrong in [false, true] {
        for (name, reversals) in kinds() {
            for law in LawName::ALL {
                let outcomes = run_all(seeds, is_wrong, law, reversals);
                is_good &= is_wrong || !outcomes.iter().any(Outcome::is_growing);
                println!("{}", format_row(is_wrong, name, law, &outcomes));
            }
        }
    }
    ExitCode::from(u8::from(!is_good))
}

fn seeds(mut words: impl Iterator<Item = String>) -> Result<u64, String> {
    let mut seeds = 40;
    while let Some(word) = words.next() {
        if word != "--seeds" {
            return Err(format!("{word:?} is no option"));
        }
        let value = words.next().ok_or(format!("{word} needs a value"))?;
        seeds = value.parse().map_err(|error| format!("--seeds: {error}"))?;
    }
    Ok(seeds)
}

/// Returns the frame in which the run with this seed reverses its target once.
fn moment(seed: u64) -> u32 {
    1 + (seed * 7 % MOMENTS) as u32
}

/// Returns the kinds of reversals with their names, for each seed.
fn kinds() -> [(&'static str, Kind); 6] {
    [
        ("never", |_| Reversals::Never),
        ("once", |seed| Reversals::Once(moment(seed))),
        ("once, from a path", |seed| Reversals::OnceOnPath(5 + moment(seed))),
        ("once, after a stop", |seed| Reversals::OnceAfterStop(2 + moment(seed))),
        ("every 0.1 to 1.5 s", |_| Reversals::Often(3, 45)),
        ("every 0.03 to 0.3 s", |_| Reversals::Often(1, 10)),
    ]
}

/// Executes the runs of a row on all processors.
fn run_all(seeds: u64, is_wrong: bool, law: LawName, reversals: Kind) -> Vec<Outcome> {
    let wirings: Vec<Wiring> =
        if is_wrong { Wiring::wrong().collect() } else { vec![Wiring::RIGHT] };
    let runs = RigKind::ALL.into_iter().flat_map(|rig| {
        let wirings = wirings.clone();
        (0..seeds).map(move |seed| {
            let wiring = wirings[seed as usize % wirings.len()];
            ReversalRun { rig, law, wiring, reversals: reversals(seed), seed }
        })
    });
    let runs: Vec<ReversalRun> = runs.collect();
    parallel::map(runs, parallel::processors(), |run| run.execute())
}

/// Formats a row of the table.
fn format_row(is_wrong: bool, name: &str, law: LawName, outcomes: &[Outcome]) -> String {
    let growing = outcomes.iter().filter(|outcome| outcome.is_growing()).count();
    let plain = outcomes.iter().filter(|outcome| outcome.plain_s.is_some()).count();
    let stopped: Vec<&Outcome> = outcomes.iter().filter(|outcome| outcome.is_stopped()).collect();
    let since = |outcome: &Outcome, time: f64| time - outcome.reversed_s.unwrap_or(0.0);
    let times = |time: &dyn Fn(&Outcome) -> f64| {
        let mut times: Vec<f64> =
            stopped.iter().map(|outcome| since(outcome, time(outcome))).collect();
        times.sort_by(f64::total_cmp);
        let quantile = |tenths: usize| times.get(times.len() * tenths / 10);
        [5, 9].map(|tenths| quantile(tenths).map_or("-".to_owned(), |time| format!("{time:.2}")))
    };
    let [median, late] = times(&|outcome| outcome.after_s);
    let [plain_median, plain_late] =
        times(&|outcome| outcome.plain_s.unwrap_or(f64::MAX).min(outcome.after_s));
    let farthest = outcomes.iter().map(|outcome| outcome.ball_m).fold(0.0, f64::max);
    let wiring = if is_wrong { "wrong" } else { "right" };
    format!(
        "| {wiring} | {name} | {law} | {} | {growing} | {plain} | {} | {median} | {late} | \
         {plain_median} | {plain_late} | {farthest:.2} |",
        outcomes.len(),
        stopped.len()
    )
}
