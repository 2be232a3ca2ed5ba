//! Drives one emulated board for hours of virtual time, session after session, and prints what
//! happened. Exits with 1 after a violation, or if the memory grew.
//!
//! Usage: `soak [--hours H] [--seed N]`. The default is 100 hours.

#![allow(clippy::expect_used, reason = "a tool for tests: it stops at the first surprise")]

use std::process::ExitCode;

use plumb_tests::soak::{Soak, SoakReport};

/// Growth of the memory after the first tenth of the time above which it counts as a leak, kB.
const LEAK_KB: u64 = 4096;

fn main() -> ExitCode {
    match options(std::env::args().skip(1)) {
        Ok((hours, seed)) => soak(hours, seed),
        Err(error) => {
            eprintln!("soak: {error}; usage: soak [--hours H] [--seed N]");
            ExitCode::from(2)
        }
    }
}

/// Returns the number of hours and the seed.
fn options(mut words: impl Iterator<Item = String>) -> Result<(f64, u64), String> {
    let (mut hours, mut seed) = (100.0, 1);
    while let Some(word) = words.next() {
        let value = words.next().ok_or(format!("{word} needs a value"))?;
        match word.as_str() {
            "--hours" => hours = value.parse().map_err(|error| format!("--hours: {error}"))?,
            "--seed" => seed = value.parse().map_err(|error| format!("--seed: {error}"))?,
            _ => return Err(format!("{word:?} is no option")),
        }
    }
    Ok((hours, seed))
}

fn soak(hours: f64, seed: u64) -> ExitCode {
    let mut soak = Soak::new(seed);
    let mut memory = Vec::new();
    for tenth in 1..=10 {
        let report = soak.run_until(hours * f64::from(tenth) / 10.0);
        memory.push(resident_kb());
        eprintln!(
            "{:.1} h: {} sessions, {} of {} targets reached, {} violations, {} kB",
            report.hours,
            report.sessions,
            report.reached,
            report.targets,
            report.violations.len(),
            resident_kb()
        );
    }
    let report = soak.run_until(hours);
    print_report(report);
    let growth = memory[9].saturating_sub(memory[0]);
    println!("memory: {} kB after a tenth of the time, {growth} kB more at the end", memory[0]);
    ExitCode::from(u8::from(!report.violations.is_empty() || growth > LEAK_KB))
}

fn print_report(report: &SoakReport) {
    println!("| disturbance | cause of the end | sessions |\n|---|---|---:|");
    for ((disturbance, cause), sessions) in &report.causes {
        println!("| {disturbance} | {cause} | {sessions} |");
    }
    println!(
        "{:.1} h, {} sessions, {} pictures, {} of {} targets reached, {} violations",
        report.hours,
        report.sessions,
        report.frames,
        report.reached,
        report.targets,
        report.violations.len()
    );
    report.violations.iter().for_each(|violation| println!("{violation}"));
}

/// Returns the resident memory of this process, kB.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("VmRSS");
    line.split_whitespace().nth(1).and_then(|kb| kb.parse().ok()).expect("a number of kB")
}
