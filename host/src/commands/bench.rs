//! `plumb bench`: the comparisons.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use plumb::bench::control::{self, PAPER_GAMMAS};
use plumb::bench::vision::{self, VisionOptions};
use plumb::camera::Camera;
use plumb::source::Source;
use plumb::source::tum::TumFolder;

use super::{DetectorName, Failure, OrFail};

#[derive(Subcommand)]
pub(crate) enum Command {
    Control(ControlArgs),
    Vision(VisionArgs),
}

/// How fast the law is on simulated rigs, through the board's own fixed point
#[derive(Parser)]
pub(crate) struct ControlArgs {
    /// What to compare
    #[arg(long, value_enum, default_value = "paper")]
    suite: Suite,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Suite {
    /// The paper's task, noise-free at 30 Hz: frames to 10 mm for several γ
    Paper,
}

/// How well and how fast the detectors find the ball in scenes from a seed
#[derive(Parser)]
pub(crate) struct VisionArgs {
    /// Pictures of each kind of scene
    #[arg(long, default_value_t = 20)]
    frames: usize,
    /// Seed of the scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A TUM RGB-D folder; balls are then also rendered into its pictures
    #[arg(long, value_name = "FOLDER")]
    background: Option<PathBuf>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn main(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Control(args) => bench_control(&args),
        Command::Vision(args) => bench_vision(&args),
    }
}

fn bench_control(args: &ControlArgs) -> Result<ExitCode, Failure> {
    let Suite::Paper = args.suite;
    let suite = control::paper(&PAPER_GAMMAS).or_failed()?;
    eprintln!("law interval on the paper's task, no noise, 30 Hz: frames to 10 mm (17 100/γ in docs/control.md)");
    for (gamma, frames) in suite.gamma.iter().zip(&suite.frames) {
        eprintln!("  γ = {gamma:4} /s  {frames:5} frames  γ·frames = {:6.0}", gamma * f64::from(*frames));
    }
    if args.json {
        println!("{}", serde_json::to_string(&suite).or_failed()?);
    }
    Ok(ExitCode::SUCCESS)
}

fn bench_vision(args: &VisionArgs) -> Result<ExitCode, Failure> {
    let camera = Camera::paper().or_bad_input()?;
    let mut recorded = Vec::new();
    if let Some(folder) = &args.background {
        let mut source = TumFolder::open(folder, camera.intrinsics).or_bad_input()?;
        while let Some(frame) = source.next_frame().or_bad_input()? {
            recorded.push(frame);
        }
    }
    let mut detectors =
        [DetectorName::Ball.detector(&camera), DetectorName::Red.detector(&camera)];
    let options = VisionOptions { frames: args.frames, seed: args.seed, ..VisionOptions::default() };
    let report =
        vision::compare(&camera, &recorded, &mut detectors, &options, &mut |scene| eprintln!("{scene}")).or_failed()?;
    eprintln!("{report}");
    if args.json {
        println!("{}", serde_json::to_string(&report).or_failed()?);
    }
    Ok(ExitCode::SUCCESS)
}
