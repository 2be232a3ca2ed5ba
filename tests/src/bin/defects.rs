//! Table of rigs that break in mid-drive and of targets out of reach, with every law: the fault
//! that stops the board, how long that takes, and how far ball and motors go. Exits with 1 if the
//! board stops a healthy rig.
//!
//! Usage: `defects [--seeds N] [--lenient]`. `--lenient` sets the guards NotFollowing and
//! NoProgress as wide as a board accepts, for comparison.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::collections::BTreeMap;
use std::process::ExitCode;

use plumb_runtime::rig::LawName;
use plumb_tests::defects::{Defect, DefectRun, End, Stop};
use plumb_tests::parallel;

const USAGE: &str = "[--seeds N] [--lenient]";

fn main() -> ExitCode {
    let (seeds, lenient) = match options(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(error) => {
            eprintln!("defects: {error}; usage: defects {USAGE}");
            return ExitCode::from(2);
        }
    };
    println!(
        "| defect | law | rigs | stopped | unnoticed | seconds, median | worst | ball, m, median \
         | worst | motor, steps, median | worst | faults |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---|");
    let mut is_good = true;
    for defect in [Defect::None].into_iter().chain(Defect::ALL) {
        for law in LawName::ALL {
            let runs = (0..seeds).map(|seed| DefectRun { defect, law, seed, lenient }).collect();
            let stops = run_all(runs);
            let stopped = stops.iter().any(|stop| matches!(stop.end, End::Stopped(_)));
            is_good &= defect != Defect::None || !stopped;
            println!("{}", format_row(defect, law, &stops));
        }
    }
    ExitCode::from(u8::from(!is_good))
}

fn options(mut words: impl Iterator<Item = String>) -> Result<(u64, bool), String> {
    let (mut seeds, mut lenient) = (50, false);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--seeds" => {
                let value = words.next().ok_or(format!("{word} needs a value"))?;
                seeds = value.parse().map_err(|error| format!("--seeds: {error}"))?;
            }
            "--lenient" => lenient = true,
            _ => return Err(format!("{word:?} is no option")),
        }
    }
    Ok((seeds, lenient))
}

/// Executes the runs on all processors.
fn run_all(runs: Vec<DefectRun>) -> Vec<Stop> {
    parallel::map(runs, parallel::processors(), |run| run.execute())
}

/// Formats a row of the table. Numbers are of the runs that were stopped.
fn format_row(defect: Defect, law: LawName, stops: &[Stop]) -> String {
    let fault = |stop: &&Stop| match stop.end {
        End::Stopped(fault) => Some(fault),
        _ => None,
    };
    let stopped: Vec<&Stop> = stops.iter().filter(|stop| fault(stop).is_some()).collect();
    let unnoticed = stops.iter().filter(|stop| stop.end == End::Unnoticed).count();
    let mut faults: BTreeMap<String, usize> = BTreeMap::new();
    for fault in stops.iter().filter_map(|stop| fault(&stop)) {
        *faults.entry(format!("{fault:?}")).or_default() += 1;
    }
    let faults: Vec<String> =
        faults.iter().map(|(fault, count)| format!("{count}x {fault}")).collect();
    let cells = |of: fn(&Stop) -> f64, digits: usize| {
        let mut values: Vec<f64> = stopped.iter().map(|stop| of(stop)).collect();
        values.sort_by(f64::total_cmp);
        match (values.get(values.len() / 2), values.last()) {
            (Some(median), Some(worst)) => format!("{median:.digits$} | {worst:.digits$}"),
            _ => "- | -".to_owned(),
        }
    };
    format!(
        "| {} | {law} | {} | {} | {unnoticed} | {} | {} | {} | {} |",
        defect.name(),
        stops.len(),
        stopped.len(),
        cells(|stop| stop.after_s, 1),
        cells(|stop| stop.ball_m, 2),
        cells(|stop| stop.turn, 0),
        faults.join("; ")
    )
}
