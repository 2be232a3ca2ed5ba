//! `plumb-lab vision`: accuracy and speed of the detectors.

use std::path::PathBuf;

use clap::{Parser, value_parser};
use plumb_bench::vision::{self, FrameSuite, VisionOptions};
use plumb_cameras::camera_file;
use plumb_cameras::tum::TumFolder;
use plumb_frame::source::CameraSource;
use plumb_vision::camera::Camera;
use plumb_vision::detect::red::RedDetector;
use plumb_vision::detect::{BallDetector, DetectorKind};
use plumb_vision::frame::RgbdFrame;

use crate::output::{self, Failure, bad_input, failed};

/// Accuracy and speed of the detectors in scenes from a seed
///
/// Suites: scenes (rendered, and balls in the first background), hard (balls of 60 mm in the
/// backgrounds under difficult conditions, and the same without a ball), rooms (rendered and
/// recorded rooms of any colour, with and without depth, and the same without a ball), disc (flat
/// discs of 60 mm, slanted by 0 to 50 degrees, without depth, and rooms without one), pair (two
/// webcams as one depth camera), empty (all of scenes and hard without a ball). Backgrounds have
/// the paper's intrinsics.
#[derive(Parser)]
#[command(after_help = "Examples:
  plumb-lab vision --frames 5
  plumb-lab vision --suite hard --background FOLDER
  plumb-lab vision --suite rooms --held-out --background FOLDER
  plumb-lab vision --suite pair --frames 3000")]
pub(crate) struct Args {
    /// Set of frames: scenes, hard, rooms, disc, pair or empty
    #[arg(long, default_value = "scenes")]
    suite: FrameSuite,
    /// Number of frames of each kind of scene, 1 to 100000 frames
    #[arg(long, default_value_t = 20, value_parser = value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Number of frames of each kind of scene without a ball, 0 to 100000 frames [default: as
    /// --frames]
    #[arg(long, value_parser = value_parser!(u32).range(..=100_000))]
    empty: Option<u32>,
    /// Seed of the scenes, 0 to 1e15
    #[arg(long, default_value_t = 1)]
    #[arg(value_parser = value_parser!(u64).range(..=1_000_000_000_000_000))]
    seed: u64,
    /// Frames of the suite rooms that no detector is made with: every fourth recorded background,
    /// other rendered rooms, other random numbers. Without this option they are left out
    #[arg(long)]
    held_out: bool,
    /// Hue of the discs of the suite disc, 0 to 359 degrees: 0 red, 120 green, 240 blue
    #[arg(long, default_value_t = 0, value_parser = value_parser!(u16).range(..360))]
    hue: u16,
    /// A TUM RGB-D folder; balls are then also rendered into its frames. May be given more than
    /// once
    #[arg(long, value_name = "FOLDER")]
    background: Vec<PathBuf>,
    /// End with a line of JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Greatest number of pixels of all backgrounds, which stay in memory: 1300 frames of 640x480, 2
/// GB.
const MAX_BACKGROUND_PIXELS: usize = 400_000_000;

/// Reads the frames of the recordings in `folders`.
fn backgrounds(
    folders: &[PathBuf],
    camera: &Camera,
    wanted: impl Fn(usize) -> bool,
) -> Result<Vec<RgbdFrame>, Failure> {
    let (mut frames, mut pixels) = (Vec::new(), 0);
    for folder in folders {
        let mut source = TumFolder::open(folder, camera.intrinsics).map_err(bad_input)?;
        let mut number = 0;
        while let Some(frame) = source.next_frame().map_err(bad_input)? {
            number += 1;
            if !wanted(number - 1) {
                continue;
            }
            pixels += frame.colour().pixels().len();
            if pixels > MAX_BACKGROUND_PIXELS {
                let why = format!(
                    "the backgrounds have more than {MAX_BACKGROUND_PIXELS} pixels; give fewer"
                );
                return Err(bad_input(format!("{}: {why}", folder.display())));
            }
            frames.push(frame);
        }
    }
    Ok(frames)
}

pub(crate) fn main(args: &Args) -> Result<(), Failure> {
    let &Args { suite, seed, held_out, .. } = args;
    let camera = Camera { ball_hue: args.hue.into(), ..camera_file::paper().map_err(bad_input)? };
    if held_out && suite != FrameSuite::Rooms {
        return Err(bad_input(format!(
            "--held-out has no effect on the suite `{suite}`: leave it out, or choose `--suite \
             rooms`"
        )));
    }
    if args.hue != 0 && suite != FrameSuite::Disc {
        return Err(bad_input("--hue has an effect on the suite `disc` only"));
    }
    if suite == FrameSuite::Pair {
        return pair(args);
    }
    let wanted = |number| suite != FrameSuite::Rooms || vision::is_held_out(number) == held_out;
    let recorded = backgrounds(&args.background, &camera, wanted)?;
    if recorded.is_empty() && suite == FrameSuite::Hard {
        return Err(bad_input("the suite `hard` needs a --background FOLDER"));
    }
    let [frames, empty] = [args.frames, args.empty.unwrap_or(args.frames)].map(|it| it as usize);
    let options = VisionOptions { suite, frames, empty, seed, held_out, ..Default::default() };
    let seen = vision::suite_camera(suite, &camera);
    let other: Box<dyn BallDetector> = match suite {
        FrameSuite::Disc => DetectorKind::Disc.build(&seen),
        _ => Box::new(RedDetector::new(&seen, options.radius)),
    };
    let mut detectors = [DetectorKind::Ball.build(&seen), other];
    let mut progress = |scene: &str| tell!("{scene}");
    let report = vision::compare(&camera, &recorded, &mut detectors, &options, &mut progress);
    let report = report.map_err(failed)?;
    tell!("{report}");
    if args.json { output::print(&report) } else { Ok(()) }
}

/// Measures two webcams as one depth camera.
fn pair(args: &Args) -> Result<(), Failure> {
    if !args.background.is_empty() || args.empty.is_some() {
        return Err(bad_input("--background and --empty have no effect on the suite `pair`"));
    }
    let mut progress = |case: &str| tell!("{case}");
    let report = vision::pair::run(args.seed, args.frames as usize, &mut progress);
    let report = report.map_err(failed)?;
    tell!("{report}");
    if args.json { output::print(&report) } else { Ok(()) }
}
