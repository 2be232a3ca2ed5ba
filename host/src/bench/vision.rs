//! `plumb bench vision`: detectors on seeded scenes, and their time against the paper's detector.

mod hard;
mod peers;
mod scenes;
mod table;
mod tally;

use std::hint::black_box;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};
use opencv::core::{
    CV_32F, Mat, MatTraitConst, Point, Size, extract_channel, get_num_threads, min_max_loc, set_num_threads,
    subtract_def,
};
use opencv::imgproc::gaussian_blur_def;
use plumb_protocol::frame::{Frame, encode};
use plumb_protocol::message::{Command, Position, ToBoard};
use plumb_protocol::units as wire;
use serde::Serialize;
use thiserror::Error;

use crate::camera::Camera;
use crate::detect::{DetectError, Detector};
use crate::frame::RgbdFrame;
use crate::locate::{Located, locate};
use crate::source::synthetic::{SyntheticCamera, SyntheticError};
use hard::HardShots;
use peers::{Hough, HsvMoments};
use scenes::{Backdrop, KINDS, Kind, Shot, Shots};
use tally::{Tally, percentile};

/// The reference is timed on the first of so many pictures.
const REFERENCE_EVERY: usize = 4;

/// Which pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suite {
    /// Rendered scenes, with a ball and without.
    Scenes,
    /// Balls of 60 mm put into recorded pictures, with what spoils the view; the same pictures without a ball.
    Hard,
    /// Those of both without a ball.
    Empty,
}

impl Suite {
    /// The suite called `name`: `scenes`, `hard` or `empty`.
    pub fn named(name: &str) -> Option<Self> {
        [("scenes", Self::Scenes), ("hard", Self::Hard), ("empty", Self::Empty)]
            .into_iter()
            .find_map(|(known, suite)| (known == name).then_some(suite))
    }
}

/// What is rendered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionOptions {
    /// Which pictures.
    pub suite: Suite,
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
        let (suite, radius) = (Suite::Scenes, 20.0);
        Self { suite, frames: 20, empty: 20, recorded_balls: 60, seed: 1, radius, width: 640, height: 480 }
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
    /// The same of pictures without a ball, if there were any.
    pub empty_ratio: Option<f64>,
    /// The scene that takes longest, and that of its median.
    pub slowest: Option<(&'static str, f64)>,
    /// From the picture to the bytes for the board (detection, location, encoding), searching, 99th percentile, milliseconds.
    pub path_p99_ms: f64,
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
    /// 95th percentile of the same: 7.8 of a normal distribution.
    pub consistency_p95: Option<f64>,
}

/// `camera` with the ball of the suite `hard`.
pub fn hard_camera(camera: &Camera) -> Camera {
    Camera { ball_diameter: hard::DIAMETER, ..camera.clone() }
}

/// Runs `detectors`, and what every tutorial does with OpenCV, over the pictures, each searched like a first one. Of
/// `camera` the intrinsics and the ball count (it stands where the scenes are built for; the ball of the hard set has its
/// own size, which detectors must have been told); `recorded` pictures, if any, are backgrounds of what needs some, else that
/// is left out; `progress` is told the name of each scene. OpenCV runs on one thread meanwhile.
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
    let detectors: Vec<&mut Box<dyn Detector>> = detectors.iter_mut().chain(&mut peers).collect();
    let _one = OneThread::new()?;
    let tallies = detectors.iter().map(|_| Tally::default()).collect();
    let mut bench = Bench { detectors, tallies, reference: Vec::new(), pictures: 0 };
    if options.suite != Suite::Hard {
        bench.scenes(camera, recorded, options, progress)?;
    }
    if options.suite != Suite::Scenes && !recorded.is_empty() {
        bench.hard(camera, recorded, options, progress)?;
    }
    Ok(bench.report(options))
}

/// Detectors and what they have done so far.
struct Bench<'a> {
    detectors: Vec<&'a mut Box<dyn Detector>>,
    tallies: Vec<Tally>,
    /// Times of the reference, milliseconds.
    reference: Vec<f64>,
    pictures: usize,
}

impl Bench<'_> {
    fn scenes(
        &mut self,
        camera: &Camera,
        recorded: &[RgbdFrame],
        options: &VisionOptions,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), VisionError> {
        let mut known: Vec<(Backdrop, Vec<SyntheticCamera>)> = Vec::new();
        for (number, kind) in (0..).zip(KINDS) {
            let unwanted = kind.ball && options.suite == Suite::Empty;
            if unwanted || (kind.backdrop == Backdrop::Recorded && recorded.is_empty()) {
                continue;
            }
            progress(kind.name);
            if !known.iter().any(|(backdrop, _)| *backdrop == kind.backdrop) {
                known.push((kind.backdrop, scenes::cameras(kind.backdrop, camera, recorded, options)?));
            }
            let cameras = known.iter().find(|(backdrop, _)| *backdrop == kind.backdrop);
            let cameras = cameras.map(|(_, cameras)| cameras.clone()).unwrap_or_default();
            let mut shots = Shots::new((number, kind), cameras, recorded, options);
            self.run(kind.name, count(&kind, options), &mut || shots.next())?;
        }
        Ok(())
    }

    fn hard(
        &mut self,
        camera: &Camera,
        recorded: &[RgbdFrame],
        options: &VisionOptions,
        progress: &mut dyn FnMut(&str),
    ) -> Result<(), VisionError> {
        for (number, kind) in (0..).zip(hard::KINDS) {
            if kind.ball && options.suite == Suite::Empty {
                continue;
            }
            progress(kind.name);
            let mut shots = HardShots::new((number, kind), camera, recorded, options);
            let count = if kind.ball { options.frames } else { options.empty };
            self.run(kind.name, count, &mut || shots.next())?;
        }
        Ok(())
    }

    /// Up to `count` pictures of one kind.
    fn run(
        &mut self,
        name: &'static str,
        count: usize,
        next: &mut dyn FnMut() -> Result<Option<Shot>, VisionError>,
    ) -> Result<(), VisionError> {
        self.tallies.iter_mut().for_each(Tally::open);
        for _ in 0..count {
            let Some(shot) = next()? else { break };
            self.round(&shot, name)?;
        }
        self.tallies.iter_mut().for_each(|tally| tally.close(name));
        Ok(())
    }

    /// One picture to the reference (not to each) and to every detector, each timed.
    fn round(&mut self, shot: &Shot, name: &'static str) -> Result<(), VisionError> {
        if self.pictures.is_multiple_of(REFERENCE_EVERY) {
            let start = computed();
            red_difference_of_gaussians(&shot.frame)?;
            self.reference.push(milliseconds(start));
        }
        self.pictures += 1;
        for (detector, tally) in self.detectors.iter_mut().zip(&mut self.tallies) {
            let of = detector.name();
            let failed = |error| VisionError::Detect { name: of, scene: name, error };
            detector.reset();
            let start = computed();
            let found = detector.detect(&shot.frame).map_err(failed)?;
            tally.times.push((milliseconds(start), shot.ball.is_some()));
            let located = found.and_then(|found| locate(&found, &shot.frame, &shot.camera));
            let sent = black_box(message(located.as_ref()));
            tally.path_times.extend(sent.map(|_| milliseconds(start)));
            tally.note(shot, found, located);
            if found.is_some() {
                let start = computed();
                detector.detect(&shot.frame).map_err(failed)?;
                tally.tracking_times.push(milliseconds(start));
            }
        }
        Ok(())
    }

    fn report(mut self, options: &VisionOptions) -> VisionReport {
        let reference_ms = percentile(&mut self.reference, 0.5).unwrap_or(0.0);
        let detectors = self
            .detectors
            .iter()
            .zip(self.tallies)
            .map(|(detector, tally)| tally.report(detector.name(), reference_ms))
            .collect();
        VisionReport { suite: "vision", seed: options.seed, frames: options.frames, reference_ms, detectors }
    }
}

/// What this thread has computed so far: a clock that other programs do not make go faster.
fn computed() -> Duration {
    // Where there is no such clock (there is on Linux) no time passes, and the table says so.
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map(Duration::from).unwrap_or_default()
}

/// What it has computed `since`, milliseconds.
fn milliseconds(since: Duration) -> f64 {
    (computed() - since).as_secs_f64() * 1e3
}

/// The bytes that tell the board where the ball is.
fn message(located: Option<&Located>) -> Option<Frame> {
    let ball = located.and_then(|l| wire::Point::from_metres(l.position.into()));
    let covariance = located.and_then(|l| wire::Covariance::from_metres2(l.covariance.transpose().into()));
    let command = Command::Position(Position { sequence: 1, age_us: 30_000, ball, covariance });
    encode(&ToBoard { id: 1, command }).ok()
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
