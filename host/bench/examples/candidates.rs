//! Prints the candidates without depth of the detector `ball` in the suite `rooms`, from which
//! `scripts/detector/choose_weights.py` chooses the weights of its decision.
//!
//! Usage: `cargo run --release -p plumb-bench --example candidates SEED FRAMES EMPTY FOLDER...`
//!
//! FRAMES and EMPTY are the numbers of frames of each kind with a ball and without one; FOLDER is a
//! TUM RGB-D folder. The frames are those of `plumb bench vision --suite rooms` with the same
//! numbers. Each frame is a line `ball NAME` or `empty NAME`. A line `candidate` follows for each
//! of its candidates: 1 if its centre is within half a radius of the ball's, otherwise 0; its
//! log-odds by the network, its part of rays with an edge, its part with depth behind it, and the
//! rms residual of its free fit.

use std::env;
use std::error::Error;
use std::path::Path;

use plumb_bench::vision::{
    FrameSuite, GroundTruth, LabelledFrame, VisionOptions, each_room, is_held_out, suite_camera,
};
use plumb_cameras::camera_file;
use plumb_cameras::source::CameraSource;
use plumb_cameras::source::tum::TumFolder;
use plumb_vision::camera::Camera;
use plumb_vision::detect::ball::ShapeDetector;
use plumb_vision::detect::shape::{CandidateTrace, Features, ShapeParameters};
use plumb_vision::frame::RgbdFrame;

/// Log-odds of a candidate beyond doubt.
const CERTAIN: f64 = 1e6;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [seed, frames, empty, folders @ ..] = arguments.as_slice() else {
        return Err("give SEED FRAMES EMPTY FOLDER...".into());
    };
    let (suite, seed) = (FrameSuite::Rooms, seed.parse()?);
    let (frames, empty) = (frames.parse()?, empty.parse()?);
    let options = VisionOptions { suite, seed, frames, empty, ..VisionOptions::default() };
    let camera = camera_file::paper()?;
    let recorded = recorded(folders, &camera)?;
    let detector = ShapeDetector::with_parameters(&suite_camera(suite, &camera), exhaustive());
    let mut failed = None;
    each_room(&camera, &recorded, &options, &mut |name, labelled| {
        if name.contains("no depth") {
            failed = failed.take().or(print(detector.clone(), name, labelled).err());
        }
    })?;
    failed.map_or(Ok(()), Err)
}

/// Reads the frames of `folders` that are not held out.
fn recorded(folders: &[String], camera: &Camera) -> Result<Vec<RgbdFrame>, Box<dyn Error>> {
    let mut frames = Vec::new();
    for folder in folders {
        let mut source = TumFolder::open(Path::new(folder), camera.intrinsics)?;
        let mut number = 0;
        while let Some(frame) = source.next_frame()? {
            frames.extend((!is_held_out(number)).then_some(frame));
            number += 1;
        }
    }
    Ok(frames)
}

/// Returns parameters of a search that no candidate ends and that reads the features of all of
/// them.
fn exhaustive() -> ShapeParameters {
    let mut parameters = ShapeParameters::DEFAULT;
    // Scores are at most 1.
    parameters.search.certain_score = 2.0;
    parameters.search.rival_log_odds = f64::INFINITY;
    parameters.weights.colour.intercept = CERTAIN;
    parameters
}

/// Prints the candidates of a frame.
fn print(
    mut detector: ShapeDetector,
    name: &str,
    labelled: &LabelledFrame,
) -> Result<(), Box<dyn Error>> {
    let (_, trace) = detector.detect_traced(&labelled.frame)?;
    println!("{} {name}", if labelled.ball.is_some() { "ball" } else { "empty" });
    for candidate in trace.searches.iter().flat_map(|search| &search.candidates) {
        let Some(decision) = &candidate.decision else { continue };
        if let (Some(Features::Colour(features)), Some(free)) =
            (&decision.features, &decision.free_fit)
        {
            let is_ball = labelled.ball.as_ref().is_some_and(|ball| is_on(candidate, ball));
            println!(
                "candidate {} {:.3} {:.3} {:.3} {:.3}",
                u8::from(is_ball),
                decision.judged,
                features.edges,
                features.through,
                free.rms
            );
        }
    }
    Ok(())
}

/// Checks whether the centre of `candidate` is within half a radius of the ball's.
fn is_on(candidate: &CandidateTrace, ball: &GroundTruth) -> bool {
    let disc = candidate.circle.disc;
    (disc.u - ball.u).hypot(disc.v - ball.v) < 0.5 * ball.radius
}
