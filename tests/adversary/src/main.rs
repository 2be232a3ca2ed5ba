//! Runs a long campaign: `adversary CAMPAIGN [--first-seed SEED] [--seeds COUNT] [--SIZE COUNT]`.

use std::process::ExitCode;
use std::thread::available_parallelism;
use std::time::Instant;

use plumb_adversary::campaign::{self, Outcome};
use plumb_adversary::{board, frames, laws, travel};

const USAGE: &str = "\
usage: adversary CAMPAIGN [--first-seed SEED] [--seeds COUNT] [--SIZE COUNT] [--threads COUNT]

campaigns, and their size for each seed:
  board    the board with adversarial messages       --ticks 20000
  frames   the frame decoder against a reference     --stretches 20000
  laws     the laws with extreme input               --measurements 2000
  travel   stops at the end of the travel            --stops 1000

Defaults: 1000 seeds from 1 on, one thread for each core. The exit code is 1 if an invariant is
broken.";

/// Maximum number of violations printed.
const MAX_PRINTED: usize = 30;

/// A campaign of the library.
#[derive(Clone, Copy)]
struct Campaign {
    name: &'static str,
    /// Option for the size.
    size: &'static str,
    default_size: u64,
    run: fn(u64, u64, &mut Outcome),
}

const CAMPAIGNS: [Campaign; 4] = [
    Campaign { name: "board", size: "--ticks", default_size: 20_000, run: board::run },
    Campaign { name: "frames", size: "--stretches", default_size: 20_000, run: frames::run },
    Campaign { name: "laws", size: "--measurements", default_size: 2_000, run: laws::run },
    Campaign { name: "travel", size: "--stops", default_size: 1_000, run: travel::run },
];

/// Options of the command line.
struct Options {
    campaign: Campaign,
    first: u64,
    seeds: u64,
    size: u64,
    threads: usize,
}

fn parse(arguments: &[String]) -> Result<Options, String> {
    let (name, rest) = arguments.split_first().ok_or("which campaign?")?;
    let campaign = CAMPAIGNS.into_iter().find(|campaign| campaign.name == name);
    let campaign = campaign.ok_or_else(|| format!("there is no campaign {name}"))?;
    let threads = available_parallelism().map_or(1, usize::from);
    let mut options =
        Options { campaign, first: 1, seeds: 1000, size: campaign.default_size, threads };
    for pair in rest.chunks(2) {
        let [option, value] = pair else { return Err(format!("{} needs a number", pair[0])) };
        let value: u64 = value.parse().map_err(|_| format!("{option} {value}: not an integer"))?;
        match option.as_str() {
            "--first-seed" => options.first = value,
            "--seeds" => options.seeds = value,
            "--threads" => options.threads = value as usize,
            size if size == campaign.size => options.size = value,
            _ => return Err(format!("{name} has no option {option}")),
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let options = match parse(&arguments) {
        Ok(options) => options,
        Err(error) => {
            eprintln!("adversary: {error}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let Options { campaign, first, seeds, size, threads } = options;
    let began = Instant::now();
    let outcome = campaign::run(first..first.saturating_add(seeds), threads, |seed, outcome| {
        (campaign.run)(seed, size, outcome);
    });
    let seconds = began.elapsed().as_secs_f64();
    println!("{}, {seeds} seeds from {first} in {seconds:.1} s: {}", campaign.name, outcome.tally);
    for violation in outcome.violations.iter().take(MAX_PRINTED) {
        println!("{violation}");
    }
    for broken in outcome.summary() {
        println!(
            "BROKEN: {} in {} runs, first with seed {}",
            broken.first.invariant, broken.runs, broken.first.seed
        );
    }
    if outcome.violations.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
