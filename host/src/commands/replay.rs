//! `plumb replay`: detection and location on a recording.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use plumb::camera::Camera;
use plumb::replay::replay_folder;

use super::{DetectorName, FAILED, Failure, OrFail};

/// Detection and location on a recording (a TUM RGB-D folder): a CSV row a frame
#[derive(Parser)]
pub(crate) struct Args {
    /// The folder, with rgb.txt and depth.txt
    folder: PathBuf,
    /// The camera file (TOML)
    #[arg(long)]
    camera: PathBuf,
    /// Detector
    #[arg(long, value_enum, default_value = "ball")]
    detector: DetectorName,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let camera = Camera::read(&args.camera).or_bad_input()?;
    let mut detector = args.detector.detector(&camera);
    let report = |problem: &plumb::replay::Problem| eprintln!("plumb: {problem}");
    let outcome =
        replay_folder(&args.folder, &camera, &mut *detector, io::stdout().lock(), report).or_bad_input()?;
    eprintln!(
        "{} frames: {} with a ball, {} of them located; {} broken, {} without depth",
        outcome.frames, outcome.detected, outcome.located, outcome.broken, outcome.without_depth
    );
    if args.json {
        let line = serde_json::json!({
            "frames": outcome.frames,
            "detected": outcome.detected,
            "located": outcome.located,
            "broken": outcome.broken,
            "without_depth": outcome.without_depth,
        });
        writeln!(io::stdout(), "{line}").or_failed()?;
    }
    Ok(if outcome.broken == 0 { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
