//! `plumb bench vision`: detectors on seeded scenes, and their time against the paper's detector.

mod peers;
mod scenes;
mod table;
mod tally;

use std::time::Instant;

use opencv::core::{
    CV_32F, Mat, MatTraitConst, Point, Size, extract_channel, get_num_threads, min_max_loc, set_num_threads,
    subtract_def,
};
use opencv::imgproc::gaussian_blur_def;
use serde::Serialize;
use thiserror::Error;

use crate::camera::Camera;
use crate::detect::{DetectError, Detector};
use crate::frame::RgbdFrame;
use crate::source::synthetic::{SyntheticCamera, SyntheticError};
use peers::{Hough, HsvMoments};
use scenes::{Backdrop, KINDS, Kind, Shot, Shots};
use tally::{Tally, percentile};

/// What is rendered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionOptions {
    /// Pictures of each kind of scene; at least 1.
    pub frames: usize,
    /// Pictures of each kind of scene without a ball; at least 1.
    pub empty: usize,
    /// Balls in recorded pictures, where there are any.
    pub recorded_balls: usize,
    /// What everything random comes from.
    pub seed: u64,
    /// Radius of the ball, pixels, ±15 % where the scene does not say another.
    pub radius: f64,
    /// Columns of the rendered pictures.
    pub width: u16,
    /// Rows of the rendered pictures.
    pub height: u16,
}

impl Default for VisionOptions {
    /// 20 pictures a scene, with a ball and without, at 640x480, balls of about 20 pixels, 60 in recorded pictures.
    fn default() -> Self {
        Self { frames: 20, empty: 20, recorded_balls: 60, seed: 1, radius: 20.0, width: 640, height: 480 }
    }
}

/// Why there is no comparison.
#[derive(Debug, Error)]
pub enum VisionError {
    /// A scene could not be rendered.
    #[error("{0}")]
    Scene(#[from] SyntheticError),
    /// A detector could not search a picture.
    #[error("detector {name}, scene \"{scene}\": {error}")]
    Detect {
        /// Which detector.
        name: &'static str,
        /// In which scene.
        scene: &'static str,
        /// What it said.
        error: DetectError,
    },
    /// OpenCV refused an operation.
    #[error("OpenCV: {0}")]
    OpenCv(#[from] opencv::Error),
    /// A number that cannot be.
    #[error("bench vision: {what} is {value}, but must be {must}")]
    Value {
        /// Which number.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        must: &'static str,
    },
}

/// The comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VisionReport {
    /// Always `"vision"`.
    pub suite: &'static str,
    /// What everything random came from.
    pub seed: u64,
    /// Pictures of each kind of scene.
    pub frames: usize,
    /// Median time of the full-size f32 difference of Gaussians on the red channel, one thread, milliseconds.
    pub reference_ms: f64,
    /// One for each detector, in the order given.
    pub detectors: Vec<DetectorReport>,
}

/// What one detector did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetectorReport {
    /// Its name.
    pub name: &'static str,
    /// Median time for a picture, one thread, milliseconds.
    pub median_ms: f64,
    /// That time over `reference_ms`.
    pub ratio: f64,
    /// The same for a picture just like the one before: of detectors that look first where the ball was.
    pub tracking_ratio: f64,
    /// Share of all balls that it hit, 0 to 1.
    pub hit_rate: f64,
    /// Detections that were no hit, in all scenes.
    pub false_alarms: usize,
    /// Mean of the squared errors of position over their covariance, in all scenes: 3 where the covariance is right.
    pub consistency: Option<f64>,
    /// Scene by scene.
    pub scenes: Vec<SceneReport>,
}

/// What one detector did in one kind of scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneReport {
    /// Which.
    pub scene: &'static str,
    /// Pictures.
    pub frames: usize,
    /// Pictures with a ball.
    pub balls: usize,
    /// Detections within half the ball's radius of its centre.
    pub hits: usize,
    /// Other detections: elsewhere than the ball, or where there is none.
    pub false_alarms: usize,
    /// Median distance of the hits from the ball's projected centre, pixels.
    pub error_median_px: Option<f64>,
    /// 95th percentile of that distance, pixels.
    pub error_p95_px: Option<f64>,
    /// Hits whose position is known.
    pub located: usize,
    /// Median distance of those from the ball's centre, millimetres.
    pub position_median_mm: Option<f64>,
    /// 95th percentile of that distance, millimetres.
    pub position_p95_mm: Option<f64>,
    /// Mean of that error squared over its covariance: 3 where the covariance says how large errors are.
    pub consistency: Option<f64>,
}

/// Runs `detectors`, and what every tutorial does with OpenCV, over the scenes, each picture searched like a first one. Of `camera` the intrinsics and the ball count (it stands where the scenes are
/// built for); `recorded` pictures, if any, are backgrounds of the scenes that need some, else those are left out;
/// `progress` is told the name of each scene. OpenCV runs on one thread meanwhile.
///
/// # Errors
/// Where a scene could not be rendered (intrinsics that do not fit the pictures) or a detector failed.
pub fn compare(
    camera: &Camera,
    recorded: &[RgbdFrame],
    detectors: &mut [Box<dyn Detector>],
    options: &VisionOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<VisionReport, VisionError> {
    check(options)?;
    let mut peers: [Box<dyn Detector>; 2] = [Box::new(Hough), Box::new(HsvMoments)];
    let mut detectors: Vec<&mut Box<dyn Detector>> = detectors.iter_mut().chain(&mut peers).collect();
    let _one = OneThread::new()?;
    let mut tallies: Vec<Tally> = detectors.iter().map(|_| Tally::default()).collect();
    let mut reference = Vec::new();
    let mut known: Vec<(Backdrop, Vec<SyntheticCamera>)> = Vec::new();
    for (number, kind) in (0..).zip(KINDS) {
        if kind.backdrop == Backdrop::Recorded && recorded.is_empty() {
            continue;
        }
        progress(kind.name);
        if !known.iter().any(|(backdrop, _)| *backdrop == kind.backdrop) {
            known.push((kind.backdrop, scenes::cameras(kind.backdrop, camera, recorded, options)?));
        }
        let cameras = known.iter().find(|(backdrop, _)| *backdrop == kind.backdrop);
        let cameras = cameras.map(|(_, cameras)| cameras.clone()).unwrap_or_default();
        let mut shots = Shots::new((number, kind), cameras, recorded, options);
        tallies.iter_mut().for_each(Tally::open);
        for _ in 0..count(&kind, options) {
            let Some(shot) = shots.next()? else { break };
            round(&shot, &kind, &mut detectors, &mut tallies, &mut reference)?;
        }
        tallies.iter_mut().for_each(|tally| tally.close(kind.name));
    }
    let reference_ms = percentile(&mut reference, 0.5).unwrap_or(0.0);
    let detectors = detectors
        .iter()
        .zip(tallies)
        .map(|(detector, tally)| tally.report(detector.name(), reference_ms))
        .collect();
    Ok(VisionReport { suite: "vision", seed: options.seed, frames: options.frames, reference_ms, detectors })
}

fn check(options: &VisionOptions) -> Result<(), VisionError> {
    if options.frames == 0 || options.empty == 0 {
        return Err(VisionError::Value { what: "the number of frames", value: 0.0, must: "1 or more" });
    }
    let room = f64::from(options.width.min(options.height)) / 6.0;
    if !(2.0..=room).contains(&options.radius) {
        let must = "at least 2 pixels and at most a sixth of the picture";
        return Err(VisionError::Value { what: "the ball's radius", value: options.radius, must });
    }
    Ok(())
}

fn count(kind: &Kind, options: &VisionOptions) -> usize {
    match kind.ball {
        false => options.empty,
        true if kind.backdrop == Backdrop::Recorded => options.recorded_balls,
        true => options.frames,
    }
}

/// One picture to the reference and to every detector, each timed.
fn round(
    shot: &Shot,
    kind: &Kind,
    detectors: &mut [&mut Box<dyn Detector>],
    tallies: &mut [Tally],
    reference: &mut Vec<f64>,
) -> Result<(), VisionError> {
    let start = Instant::now();
    red_difference_of_gaussians(&shot.frame)?;
    reference.push(start.elapsed().as_secs_f64() * 1e3);
    for (detector, tally) in detectors.iter_mut().zip(tallies) {
        detector.reset();
        let mut timed = |times: &mut Vec<f64>| {
            let start = Instant::now();
            let found = detector.detect(&shot.frame);
            times.push(start.elapsed().as_secs_f64() * 1e3);
            found.map_err(|error| VisionError::Detect { name: detector.name(), scene: kind.name, error })
        };
        let found = timed(&mut tally.times)?;
        if found.is_some() {
            timed(&mut tally.tracking_times)?;
        }
        tally.note(shot, found);
    }
    Ok(())
}

/// What times are compared with: the paper's map at full size, for a ball of 20 pixels, and its highest point.
fn red_difference_of_gaussians(frame: &RgbdFrame) -> opencv::Result<Point> {
    let (mut red, mut wide, mut narrow, mut map) =
        (Mat::default(), Mat::default(), Mat::default(), Mat::default());
    extract_channel(frame.colour(), &mut map, 2)?;
    map.convert_to_def(&mut red, CV_32F)?;
    gaussian_blur_def(&red, &mut narrow, Size::default(), 12.0)?;
    gaussian_blur_def(&red, &mut wide, Size::default(), 19.2)?;
    subtract_def(&narrow, &wide, &mut map)?;
    let mut place = Point::default();
    min_max_loc(&map, None, None, None, Some(&mut place), &Mat::default())?;
    Ok(place)
}

/// OpenCV on one thread for as long as this lives.
struct OneThread(i32);

impl OneThread {
    fn new() -> opencv::Result<Self> {
        let before = get_num_threads()?;
        set_num_threads(1)?;
        Ok(Self(before))
    }
}

impl Drop for OneThread {
    fn drop(&mut self) {
        // Nothing can be done about a failure here, and nothing depends on it but speed.
        let _ = set_num_threads(self.0);
    }
}

#[cfg(test)]
mod tests;
