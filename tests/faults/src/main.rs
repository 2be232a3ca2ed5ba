//! Runs the campaign and draws its tables. Exits with 1 if an invariant is broken or a run is
//! undecided.
//!
//! Usage: `faults [--runs N] [--chip-runs N] [--first-seed SEED] [--threads N] [--verbose]
//! [--page]`. The defaults are 10 000 runs on the emulated board and 200 on the firmware in the
//! emulated chip. `--page` writes the tables into the book.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::process::ExitCode;

use plumb_faults::page::replace_table;
use plumb_faults::plan::{Goal, Plan};
use plumb_faults::report::Report;
use plumb_faults::run::{on_chip, on_emulated_board};
use plumb_faults::table::{Row, heading, rows};
use plumb_tests::chip::firmware_image;
use plumb_tests::parallel;

const USAGE: &str =
    "[--runs N] [--chip-runs N] [--first-seed SEED] [--threads N] [--verbose] [--page]";
/// Maximum number of broken runs printed.
const MAX_PRINTED: usize = 40;

/// Options of the command line.
struct Options {
    runs: u64,
    chip_runs: u64,
    first: u64,
    threads: usize,
    is_verbose: bool,
    /// Whether the tables are written into the book.
    is_page: bool,
}

fn options(mut words: impl Iterator<Item = String>) -> Result<Options, String> {
    let mut options = Options {
        runs: 10_000,
        chip_runs: 200,
        first: 0,
        threads: parallel::processors(),
        is_verbose: false,
        is_page: false,
    };
    while let Some(word) = words.next() {
        let mut value = || -> Result<u64, String> {
            let value = words.next().ok_or(format!("{word} needs a value"))?;
            value.parse().map_err(|error| format!("{word}: {error}"))
        };
        match word.as_str() {
            "--runs" => options.runs = value()?,
            "--chip-runs" => options.chip_runs = value()?,
            "--first-seed" => options.first = value()?,
            "--threads" => options.threads = value()? as usize,
            "--verbose" => options.is_verbose = true,
            "--page" => options.is_page = true,
            _ => return Err(format!("{word:?} is no option")),
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    let options = match options(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(error) => {
            eprintln!("faults: {error}; usage: faults {USAGE}");
            return ExitCode::from(2);
        }
    };
    let mut is_good = true;
    if options.runs > 0 {
        let run = |seed| on_emulated_board(&Plan::draw(seed));
        is_good &= show(&options, "board", &run_all(&options, options.runs, run));
    }
    if options.chip_runs > 0 {
        let Some(image) = firmware_image() else { return ExitCode::from(2) };
        let run = |seed| on_chip(&Plan::draw_short(seed), &image);
        is_good &= show(&options, "chip", &run_all(&options, options.chip_runs, run));
    }
    ExitCode::from(u8::from(!is_good))
}

/// Prints the tables of the reports of a `board`, and the broken runs. Returns whether there is
/// none.
fn show(options: &Options, board: &str, reports: &[Report]) -> bool {
    let (targets, paths): (Vec<&Report>, Vec<&Report>) =
        reports.iter().partition(|report| report.plan.goal == Goal::Targets);
    show_table(options, board, &targets);
    show_table(options, &format!("{board}-path"), &paths);
    let broken: Vec<&Report> = reports.iter().filter(|report| !report.is_good()).collect();
    for report in broken.iter().take(MAX_PRINTED) {
        println!("BROKEN: {}, {}, {:?}", report.faults(), report.plan.law, report.end);
        report.violations.iter().for_each(|violation| println!("  {violation}"));
        println!("  {}", report.command());
    }
    println!(
        "{} runs on the emulated {board}, {} of them along paths; {} broken or undecided\n",
        reports.len(),
        paths.len(),
        broken.len()
    );
    broken.is_empty()
}

/// Prints the table `name` of these reports, and writes it into the page where the options say so.
fn show_table(options: &Options, name: &str, reports: &[&Report]) {
    let rows: Vec<String> = rows(reports).iter().map(Row::format).collect();
    let table = format!("{}\n{}", heading(), rows.join("\n"));
    println!("Table {name}:\n{table}\n");
    if options.is_page {
        replace_table(name, &table).expect("the page of the campaign");
    }
}

/// Executes `runs` runs. Returns their reports in the order of the seeds.
fn run_all(options: &Options, runs: u64, run: impl Fn(u64) -> Report + Sync) -> Vec<Report> {
    parallel::map(options.first..options.first + runs, options.threads, |seed| {
        let report = run(seed);
        if options.is_verbose {
            println!("{report:#?}");
        }
        report
    })
}
