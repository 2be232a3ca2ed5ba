//! Fuzzes the targets with the seeded generator:
//! `fuzz [TARGET...] [--smoke | --executions COUNT | --seconds COUNT] [--seed SEED]`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use plumb_fuzz::campaign::{self, Report};
use plumb_fuzz::corpus;
use plumb_fuzz::target::{TARGETS, Target, named};

const USAGE: &str = "\
usage: fuzz [TARGET...] [--smoke | --executions COUNT | --seconds COUNT] [--seed SEED]
            [--corpus FOLDER]

Calls each target (all by default) with the inputs of its corpus and with changed ones, for 10
seconds by default, with --smoke as often as in `make test`. Prints a table. Inputs that made a
target panic are written to target/fuzz/crashes. The exit code is 1 if there is one.";

/// Folder of the inputs that made a target panic.
const CRASHES: &str = "target/fuzz/crashes";

/// End of the campaign of a target.
#[derive(Clone, Copy)]
enum Limit {
    /// [`Target::smoke`] executions.
    Smoke,
    Executions(u64),
    Time(Duration),
}

struct Options {
    targets: Vec<&'static Target>,
    limit: Limit,
    seed: u64,
    corpus: PathBuf,
}

fn parse(arguments: &[String]) -> Result<Options, String> {
    let mut options = Options {
        targets: Vec::new(),
        limit: Limit::Time(Duration::from_secs(10)),
        seed: 1,
        corpus: corpus::folder(),
    };
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        if !argument.starts_with("--") {
            let target = named(argument).ok_or_else(|| format!("there is no target {argument}"))?;
            options.targets.push(target);
            continue;
        }
        if argument == "--smoke" {
            options.limit = Limit::Smoke;
            continue;
        }
        let value = arguments.next().ok_or_else(|| format!("{argument} needs a value"))?;
        let number = || value.parse().map_err(|_| format!("{argument} {value}: not an integer"));
        match argument.as_str() {
            "--executions" => options.limit = Limit::Executions(number()?),
            "--seconds" => options.limit = Limit::Time(Duration::from_secs(number()?)),
            "--seed" => options.seed = number()?,
            "--corpus" => options.corpus = value.into(),
            _ => return Err(format!("there is no option {argument}")),
        }
    }
    if options.targets.is_empty() {
        options.targets = TARGETS.iter().collect();
    }
    Ok(options)
}

/// Fuzzes one target.
fn fuzz(target: &Target, options: &Options) -> io::Result<Report> {
    let inputs = corpus::read(&options.corpus, target)?;
    let begin = Instant::now();
    Ok(campaign::run(target, &inputs, options.seed, |executions| match options.limit {
        Limit::Smoke => executions < target.smoke,
        Limit::Executions(most) => executions < most,
        // Reading the clock takes as long as the quickest targets.
        Limit::Time(most) => executions % 16 != 0 || begin.elapsed() < most,
    }))
}

/// Writes the inputs of crashes.
fn save(target: &Target, report: &Report) -> io::Result<()> {
    for crash in &report.crashes {
        fs::create_dir_all(CRASHES)?;
        let path = Path::new(CRASHES).join(format!("{}-{}", target.name, crash.execution));
        fs::write(&path, &crash.input)?;
        eprintln!("fuzz: {} panics with {}", target.name, path.display());
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let options = match parse(&arguments) {
        Ok(options) => options,
        Err(error) => {
            eprintln!("fuzz: {error}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    println!("| target | executions | MB of input | slowest, ms | crashes |");
    println!("|---|---|---|---|---|");
    let mut crashes = 0;
    for target in &options.targets {
        let report = match fuzz(target, &options) {
            Ok(report) => report,
            Err(error) => {
                eprintln!("fuzz: the corpus of {}: {error}", target.name);
                return ExitCode::from(2);
            }
        };
        let Report { executions, bytes, slowest, crashes: found } = &report;
        let (megabytes, slowest) = (*bytes as f64 / 1e6, slowest.as_secs_f64() * 1e3);
        let (name, count) = (target.name, found.len());
        println!("| {name} | {executions} | {megabytes:.1} | {slowest:.1} | {count} |");
        crashes += count;
        if let Err(error) = save(target, &report) {
            eprintln!("fuzz: the crashes of {name} cannot be written: {error}");
        }
    }
    if crashes == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
