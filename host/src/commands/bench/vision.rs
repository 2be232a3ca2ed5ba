//! `plumb bench vision`: accuracy and speed of the detectors.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use plumb_bench::vision::{self, FrameSuite, VisionOptions};
use plumb_cameras::camera_file;
use plumb_cameras::tum::TumFolder;
use plumb_frame::source::CameraSource;
use plumb_vision::camera::Camera;
use plumb_vision::detect::red::RedDetector;
use plumb_vision::detect::{BallDetector, DetectorKind};
use plumb_vision::frame::RgbdFrame;

use crate::commands::print::{self, tell};
use crate::commands::{Failure, bad_input, numbers};

/// Accuracy and speed of the detectors in scenes from a seed
///
/// Suites: scenes (rendered, and balls in the first background), hard (balls of 60 mm in the
/// backgrounds under difficult conditions, and the same without a ball), rooms (rendered and
/// recorded rooms of any colour, with and without depth, and the same without a ball), empty (all
/// of scenes and hard without a ball). Backgrounds have the paper's intrinsics.
#[derive(Parser)]
#[command(
    after_help = examples![
        "plumb bench vision --frames 5",
        "plumb bench vision --suite hard --background FOLDER",
        "plumb bench vision --suite rooms --held-out --background FOLDER",
    ]
)]
pub(crate) struct VisionArgs {
    /// Set of frames: scenes, hard, rooms or empty
    #[arg(long, default_value = "scenes")]
    suite: FrameSuite,
    /// Number of frames of each kind of scene, 1 to 100000 frames
    #[arg(long, default_value_t = 20, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<usize>(1.0, 1e5, "frames"))]
    frames: usize,
    /// Number of frames of each kind of scene without a ball, 0 to 100000 frames [default: as
    /// --frames]
    #[arg(long, allow_negative_numbers = true)]
    #[arg(value_parser = numbers::whole::<usize>(0.0, 1e5, "frames"))]
    empty: Option<usize>,
    /// Seed of the scenes, 0 to 1e15
    #[arg(long, default_value_t = 1, allow_negative_numbers = true, value_parser = numbers::seed())]
    seed: u64,
    /// Frames of the suite rooms that no detector is made with: every fourth recorded background,
    /// other rendered rooms, other random numbers. Without this option they are left out
    #[arg(long)]
    held_out: bool,
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
        let mut source = TumFolder::open(folder, camera.intrinsics)?;
        let mut number = 0;
        while let Some(frame) = source.next_frame()? {
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

/// Comparison that is ready to begin.
pub(super) struct Prepared {
    camera: Camera,
    recorded: Vec<RgbdFrame>,
    detectors: [Box<dyn BallDetector>; 2],
    options: VisionOptions,
}

/// Reads the backgrounds and makes the detectors.
pub(super) fn prepare(args: &VisionArgs) -> Result<Prepared, Failure> {
    let camera = camera_file::paper()?;
    if args.held_out && args.suite != FrameSuite::Rooms {
        return Err(bad_input(format!(
            "--held-out has no effect on the suite `{}`: leave it out, or choose `--suite rooms`",
            args.suite
        )));
    }
    let wanted = |number| match args.suite {
        FrameSuite::Rooms => vision::is_held_out(number) == args.held_out,
        FrameSuite::Scenes | FrameSuite::Hard | FrameSuite::Empty => true,
    };
    let recorded = backgrounds(&args.background, &camera, wanted)?;
    let empty = args.empty.unwrap_or(args.frames);
    if recorded.is_empty() && args.suite == FrameSuite::Hard {
        return Err(bad_input("the suite `hard` needs a --background FOLDER"));
    }
    let (suite, frames, seed) = (args.suite, args.frames, args.seed);
    let held_out = args.held_out;
    let options = VisionOptions { suite, frames, empty, seed, held_out, ..Default::default() };
    let seen = vision::suite_camera(suite, &camera);
    let detectors: [Box<dyn BallDetector>; 2] =
        [DetectorKind::Ball.build(&seen), Box::new(RedDetector::new(&seen, options.radius))];
    Ok(Prepared { camera, recorded, detectors, options })
}

pub(crate) fn main(args: &VisionArgs) -> Result<ExitCode, Failure> {
    let Prepared { camera, recorded, mut detectors, options } = prepare(args)?;
    let report = vision::compare(&camera, &recorded, &mut detectors, &options, &mut |scene| {
        tell!("{scene}")
    })?;
    tell!("{report}");
    if args.json {
        print::result(serde_json::to_string(&report)?)?;
    }
    Ok(ExitCode::SUCCESS)
}
