//! Prints the candidates of the detector `ball` in a suite, from which `scripts/detector` fits the
//! weights of its decision.
//!
//! Usage:
//! `cargo run --release -p plumb-bench --example candidates SUITE SEED FRAMES EMPTY FOLDER...`
//!
//! SUITE is one of `plumb bench vision`. FRAMES and EMPTY are the numbers of frames of each kind
//! with a ball and without one; FOLDER is a TUM RGB-D folder. The frames are those of
//! `plumb bench vision` with the same numbers, but for the recorded ones that are held out. Each
//! frame is a line `ball NAME` or `empty NAME`. A line follows for each of its candidates: `colour`
//! for one without depth, `depth` for one with depth, then pairs of a name and a number. `on_ball`
//! is 1 if the candidate's centre is within half a radius of the ball's, otherwise 0; the others
//! are its features.

use std::env;
use std::error::Error;
use std::path::Path;

use plumb_bench::vision::{
    GroundTruth, LabelledFrame, VisionOptions, each_frame, is_held_out, suite_camera,
};
use plumb_cameras::camera_file;
use plumb_cameras::source::CameraSource;
use plumb_cameras::source::tum::TumFolder;
use plumb_vision::camera::Camera;
use plumb_vision::detect::ball::ShapeDetector;
use plumb_vision::detect::shape::{
    CandidateTrace, ColourFeatures, Curvature, DepthFeatures, Features, FreeFitResidual,
    ShapeParameters,
};
use plumb_vision::frame::RgbdFrame;

/// Log-odds of a candidate beyond doubt.
const CERTAIN: f64 = 1e6;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [suite, seed, frames, empty, folders @ ..] = arguments.as_slice() else {
        return Err("give SUITE SEED FRAMES EMPTY FOLDER...".into());
    };
    let (suite, seed) = (suite.parse()?, seed.parse()?);
    let (frames, empty) = (frames.parse()?, empty.parse()?);
    let options = VisionOptions { suite, seed, frames, empty, ..VisionOptions::default() };
    let camera = camera_file::paper()?;
    let recorded = recorded(folders, &camera)?;
    let detector = ShapeDetector::with_parameters(&suite_camera(suite, &camera), exhaustive());
    let mut failed = None;
    each_frame(&camera, &recorded, &options, &mut |name, labelled| {
        failed = failed.take().or(print(detector.clone(), name, labelled).err());
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
    let raised = CERTAIN - parameters.weights.depth.intercept;
    parameters.weights.depth.intercept = CERTAIN;
    parameters.decide.min_log_odds_with_depth += raised;
    parameters.decide.min_screened_with_depth += raised;
    parameters
}

/// Prints the candidates of a frame.
fn print(
    mut detector: ShapeDetector,
    name: &str,
    labelled: &LabelledFrame,
) -> Result<(), Box<dyn Error>> {
    let (_, trace) = detector.detect_traced(&labelled.frame);
    println!("{} {name}", if labelled.ball.is_some() { "ball" } else { "empty" });
    for candidate in trace.searches.iter().flat_map(|search| &search.candidates) {
        let Some(decision) = &candidate.decision else { continue };
        let (Some(judged), Some(features), Some(free)) =
            (decision.judged, &decision.features, &decision.free_fit)
        else {
            continue;
        };
        let is_ball = labelled.ball.as_ref().is_some_and(|ball| is_on(candidate, ball));
        let on_ball = u8::from(is_ball);
        match features {
            Features::Colour(features) => print_colour(on_ball, judged, features, free),
            Features::Depth(features) => print_depth(on_ball, judged, features, free),
        }
    }
    Ok(())
}

/// Prints the features of a candidate without depth.
fn print_colour(on_ball: u8, judged: f64, features: &ColourFeatures, free: &FreeFitResidual) {
    println!(
        "colour on_ball {on_ball} judged {judged:.3} edges {:.3} through {:.3} \
         likeness {:.3} rms {:.3}",
        features.edges, features.through, features.likeness, free.rms
    );
}

/// Prints the features of a candidate with depth.
fn print_depth(on_ball: u8, judged: f64, features: &DepthFeatures, free: &FreeFitResidual) {
    print!("depth on_ball {on_ball} judged {judged:.3} attached {:.3}", features.attached);
    print!(" continued {:.3} likeness {:.3}", features.continued, features.likeness);
    if let Some(Curvature { least, most }) = features.curvature {
        print!(" least {least:.3} most {most:.3}");
    }
    println!(" off_sphere {:.4} size {:.3} rms {:.3}", features.off_sphere, free.size, free.rms);
}

/// Checks whether the centre of `candidate` is within half a radius of the ball's.
fn is_on(candidate: &CandidateTrace, ball: &GroundTruth) -> bool {
    let disc = candidate.circle.disc;
    (disc.u - ball.u).hypot(disc.v - ball.v) < 0.5 * ball.radius
}
