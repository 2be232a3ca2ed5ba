//! Table of runs with every law over every link, with three targets and several seeds each. Exits
//! with 1 if a run fails a check.
//!
//! Usage: `links [--seeds N] [--link WORD] [--law NAME] [--runs] [--real-time]`. `--link` selects
//! the links with WORD in their names; `--runs` also prints every failed run; `--real-time` runs
//! over pseudo-terminals, at ten seconds or more per run, without the links that fall silent.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::collections::BTreeMap;
use std::process::ExitCode;

use plumb_runtime::rig::LawName;
use plumb_tests::links::{
    LinkCase, LinkRun, Outcome, Verdict, check_run, in_real_time, in_virtual_time, links,
};
use plumb_tests::parallel;

const USAGE: &str = "[--seeds N] [--link WORD] [--law NAME] [--runs] [--real-time]";

/// Options of the command line.
struct Options {
    seeds: u64,
    link: String,
    law: String,
    runs: bool,
    /// Whether to run over pseudo-terminals.
    real_time: bool,
}

/// A finished run.
struct Done {
    run: LinkRun,
    outcome: Outcome,
    verdict: Verdict,
}

fn main() -> ExitCode {
    let options = match options(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(error) => {
            eprintln!("links: {error}; usage: links {USAGE}");
            return ExitCode::from(2);
        }
    };
    let mut done =
        run_all(planned(&options), if options.real_time { in_real_time } else { in_virtual_time });
    done.sort_by_key(|done| done.run.seed);
    let mut rows: Vec<(&str, LawName)> = Vec::new();
    for link in links() {
        rows.extend(LawName::ALL.map(|law| (link.name, law)));
    }
    println!(
        "| link | law | runs | legs driven | false reached | violations | s to the cause | causes |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---|");
    for (link, law) in rows {
        let row: Vec<&Done> =
            done.iter().filter(|d| d.run.link.name == link && d.run.law == law).collect();
        if !row.is_empty() {
            println!("{}", format_row(link, law, &row));
        }
    }
    let failed: Vec<&Done> = done.iter().filter(|done| !done.verdict.is_good()).collect();
    if options.runs {
        failed.iter().for_each(|done| println!("{}", format_violations(done)));
    }
    println!("{} runs, {} failed", done.len(), failed.len());
    ExitCode::from(u8::from(!failed.is_empty() || done.is_empty()))
}

fn options(mut words: impl Iterator<Item = String>) -> Result<Options, String> {
    let (link, law) = (String::new(), String::new());
    let mut options = Options { seeds: 20, link, law, runs: false, real_time: false };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--seeds" => options.seeds = value()?.parse().map_err(|e| format!("--seeds: {e}"))?,
            "--link" => options.link = value()?,
            "--law" => options.law = value()?,
            "--runs" => options.runs = true,
            "--real-time" => options.real_time = true,
            _ => return Err(format!("{word:?} is no option")),
        }
    }
    Ok(options)
}

/// Returns the runs that the options select.
fn planned(options: &Options) -> Vec<LinkRun> {
    let mut runs = Vec::new();
    // In real time the board's deadlines are long, so that a silence has no effect.
    let is_selected = |link: &LinkCase| {
        link.name.contains(&options.link) && !(options.real_time && link.falls_silent())
    };
    for link in links().into_iter().filter(is_selected) {
        for law in LawName::ALL.into_iter().filter(|law| law.as_str().contains(&options.law)) {
            runs.extend((0..options.seeds).map(|seed| LinkRun { link, law, seed }));
        }
    }
    runs
}

/// Executes the runs on all processors.
fn run_all(runs: Vec<LinkRun>, execute: fn(&LinkRun) -> Outcome) -> Vec<Done> {
    parallel::map(runs, parallel::processors(), |run| {
        let outcome = execute(&run);
        let verdict = check_run(&run, &outcome);
        Done { run, outcome, verdict }
    })
}

/// Formats a row of the table.
fn format_row(link: &str, law: LawName, row: &[&Done]) -> String {
    let targets: usize = row.iter().map(|d| d.outcome.targets).sum();
    let driven: usize = row.iter().map(|d| d.verdict.driven).sum();
    let false_claims: usize = row.iter().map(|d| d.verdict.false_reached.len()).sum();
    let violations = row.iter().filter(|d| !d.verdict.violations.is_empty()).count();
    let latest = row.iter().filter_map(|d| d.verdict.cause_after_s).reduce(f64::max);
    let latest = latest.map_or("-".to_owned(), |s| format!("{s:.1}"));
    let mut causes: BTreeMap<&str, usize> = BTreeMap::new();
    for done in row.iter().filter(|d| d.outcome.exit_code != 0) {
        *causes.entry(&done.outcome.cause).or_default() += 1;
    }
    let causes: Vec<String> =
        causes.iter().map(|(cause, count)| format!("{count}x {cause}")).collect();
    format!(
        "| {link} | {law} | {} | {driven}/{targets} | {false_claims} | {violations} \
         | {latest} | {} |",
        row.len(),
        causes.join("; ")
    )
}

/// Formats the failed checks of a run.
fn format_violations(Done { run, outcome, verdict }: &Done) -> String {
    let mut what: Vec<String> =
        verdict.false_reached.iter().map(|leg| format!("false \"reached\" of {leg}")).collect();
    what.extend(verdict.violations.clone());
    let legs: Vec<String> = outcome
        .legs
        .iter()
        .map(|l| format!("{} frames {:.1} mm", l.frames, l.true_error_m * 1e3))
        .collect();
    format!(
        "{}, {}, seed {}: {} [{}]",
        run.link.name,
        run.law,
        run.seed,
        what.join("; "),
        legs.join(", ")
    )
}
