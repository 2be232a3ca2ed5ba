//! Prints the candidates of the detector `ball` in a suite, from which `scripts/detector` fits the
//! weights of its decision.
//!
//! Usage:
//! `cargo run --release -p plumb-bench --example candidates SUITE SEED FRAMES EMPTY FOLDER...`
//!
//! SUITE is one of `plumb-lab vision`. FRAMES and EMPTY are the numbers of frames of each kind
//! with a ball and without one; FOLDER is a TUM RGB-D folder. The frames are those of
//! `plumb-lab vision` with the same numbers, but for the recorded ones that are held out. Each
//! frame is a line `ball NAME` or `empty NAME`. A line follows for each of its candidates: `colour`
//! for one without depth, `depth` for one with depth, then pairs of a name and a number. `on_ball`
//! is 1 if the candidate's centre is within half a radius of the ball's, otherwise 0; the others
//! are its features.

mod common;

use common::Suite;
use plumb_bench::vision::{GroundTruth, LabelledFrame, each_frame};
use plumb_frame::source::BoxedError;
use plumb_vision::detect::ball::ShapeDetector;
use plumb_vision::detect::shape::{
    CandidateTrace, ColourFeatures, Curvature, DepthFeatures, Features, FreeFitResidual,
};

fn main() -> Result<(), BoxedError> {
    let Suite { camera, recorded, options, detector } = Suite::from_arguments()?;
    let mut failed = None;
    each_frame(&camera, &recorded, &options, &mut |name, labelled| {
        failed = failed.take().or(print(detector.clone(), name, labelled).err());
    })?;
    failed.map_or(Ok(()), Err)
}

/// Prints the candidates of a frame.
fn print(
    mut detector: ShapeDetector,
    name: &str,
    labelled: &LabelledFrame,
) -> Result<(), BoxedError> {
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
