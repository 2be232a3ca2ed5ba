//! What the examples for `scripts/detector` have in common: their arguments, recorded frames, and a
//! search that no candidate ends.

use std::env;
use std::path::Path;

use plumb_bench::vision::{VisionOptions, is_held_out, suite_camera};
use plumb_cameras::camera_file;
use plumb_cameras::tum::TumFolder;
use plumb_frame::source::{BoxedError, CameraSource};
use plumb_vision::camera::Camera;
use plumb_vision::detect::ball::ShapeDetector;
use plumb_vision::detect::shape::ShapeParameters;
use plumb_vision::frame::RgbdFrame;

/// Log-odds of a candidate beyond doubt.
const CERTAIN: f64 = 1e6;

/// A suite of `plumb-lab vision` and the detector that searches it.
pub(crate) struct Suite {
    /// The camera of the rig file.
    pub(crate) camera: Camera,
    /// Recorded frames, without those that are held out.
    pub(crate) recorded: Vec<RgbdFrame>,
    /// Suite, seed and numbers of frames.
    pub(crate) options: VisionOptions,
    /// Reads the features of all candidates.
    pub(crate) detector: ShapeDetector,
}

impl Suite {
    /// Reads the program's arguments, SUITE SEED FRAMES EMPTY FOLDER..., and the recorded frames.
    pub(crate) fn from_arguments() -> Result<Self, BoxedError> {
        let arguments: Vec<String> = env::args().skip(1).collect();
        let [suite, seed, frames, empty, folders @ ..] = arguments.as_slice() else {
            return Err("give SUITE SEED FRAMES EMPTY FOLDER...".into());
        };
        let (suite, seed) = (suite.parse()?, seed.parse()?);
        let (frames, empty) = (frames.parse()?, empty.parse()?);
        let options = VisionOptions { suite, seed, frames, empty, ..VisionOptions::default() };
        let camera = camera_file::paper()?;
        let recorded = recorded(folders, &camera)?;
        let seen = suite_camera(suite, &camera);
        let detector = ShapeDetector::with_parameters(&seen, exhaustive());
        Ok(Self { camera, recorded, options, detector })
    }
}

/// Reads the frames of `folders` that are not held out.
fn recorded(folders: &[String], camera: &Camera) -> Result<Vec<RgbdFrame>, BoxedError> {
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
