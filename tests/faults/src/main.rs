//! Runs the campaign and draws its table. Exits with 1 if an invariant is broken or a run is
//! undecided.
//!
//! Usage: `faults [--runs N] [--first-seed SEED] [--threads N] [--verbose]`.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::process::ExitCode;
use std::sync::Mutex;
use std::thread;

use plumb_faults::plan::Plan;
use plumb_faults::report::Report;
use plumb_faults::run::run;
use plumb_faults::table::{heading, rows};

const USAGE: &str = "[--runs N] [--first-seed SEED] [--threads N] [--verbose]";
/// Maximum number of broken runs printed.
const MAX_PRINTED: usize = 40;

/// Options of the command line.
struct Options {
    runs: u64,
    first: u64,
    threads: usize,
    is_verbose: bool,
}

fn options(mut words: impl Iterator<Item = String>) -> Result<Options, String> {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let mut options = Options { runs: 10_000, first: 0, threads, is_verbose: false };
    while let Some(word) = words.next() {
        let mut value = || -> Result<u64, String> {
            let value = words.next().ok_or(format!("{word} needs a value"))?;
            value.parse().map_err(|error| format!("{word}: {error}"))
        };
        match word.as_str() {
            "--runs" => options.runs = value()?,
            "--first-seed" => options.first = value()?,
            "--threads" => options.threads = value()? as usize,
            "--verbose" => options.is_verbose = true,
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
    let reports = run_all(&options);
    println!("{}", heading());
    for row in rows(&reports) {
        println!("{}", row.format());
    }
    let broken: Vec<&Report> = reports.iter().filter(|report| !report.is_good()).collect();
    for report in broken.iter().take(MAX_PRINTED) {
        let kinds: Vec<_> = report.plan.faults.iter().map(|f| f.kind.traits().name).collect();
        println!("BROKEN: {}, {}, {:?}", kinds.join(" and "), report.law(), report.end);
        report.violations.iter().for_each(|violation| println!("  {violation}"));
        println!("  {}", report.command());
    }
    println!("{} runs, {} broken or undecided", reports.len(), broken.len());
    ExitCode::from(u8::from(!broken.is_empty() || reports.is_empty()))
}

/// Executes the runs.
fn run_all(options: &Options) -> Vec<Report> {
    let (queue, done) = (Mutex::new(options.first..options.first + options.runs), Mutex::default());
    let work = || {
        loop {
            let next = queue.lock().expect("no run panics").next();
            let Some(seed) = next else { return };
            let report = run(&Plan::draw(seed));
            if options.is_verbose {
                println!("{report:#?}");
            }
            done.lock()
                .map(|mut done: std::sync::MutexGuard<Vec<Report>>| done.push(report))
                .expect("no run panics");
        }
    };
    thread::scope(|scope| {
        for _ in 0..options.threads.max(1) {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().expect("no run panics");
    done.sort_by_key(|report| report.plan.seed);
    done
}
