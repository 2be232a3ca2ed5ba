//! `plumb bench vision`: detectors on seeded scenes, and their time against the paper's detector.

mod baselines;
mod hard;
mod report;
mod run;
mod scenes;
mod table;
mod tally;
mod timing;

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use thiserror::Error;

use crate::UnknownName;
use baselines::{Hough, HsvMoments};
use plumb_sim::synthetic::SyntheticError;
pub use report::{DetectorReport, SceneReport, VisionReport};
use run::Bench;
use timing::OneThread;

/// Set of frames to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameSuite {
    /// Rendered scenes, with and without a ball.
    Scenes,
    /// Recorded frames with a ball of 60 mm under difficult conditions, and without a ball.
    Hard,
    /// The frames without a ball of both suites.
    Empty,
}

impl FrameSuite {
    /// Every suite.
    pub const ALL: [Self; 3] = [Self::Scenes, Self::Hard, Self::Empty];

    /// Returns the name in options.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Scenes => "scenes",
            Self::Hard => "hard",
            Self::Empty => "empty",
        }
    }
}

impl Display for FrameSuite {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for FrameSuite {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let known = || UnknownName::new(Self::ALL);
        Self::ALL.into_iter().find(|suite| suite.as_str() == text).ok_or_else(known)
    }
}

/// What is rendered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionOptions {
    /// Which pictures.
    pub suite: FrameSuite,
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
    /// 20 pictures a scene, with a ball and without, at 640x480, balls of about 20 pixels, 60 in
    /// recorded pictures.
    fn default() -> Self {
        let (suite, radius) = (FrameSuite::Scenes, 20.0);
        Self {
            suite,
            frames: 20,
            empty: 20,
            recorded_balls: 60,
            seed: 1,
            radius,
            width: 640,
            height: 480,
        }
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

/// Returns the camera of the pictures of `suite`: the intrinsics and the ball's hue of `camera`,
/// where the scenes are built for, and with the ball of the suite `hard` for that suite.
pub fn suite_camera(suite: FrameSuite, camera: &Camera) -> Camera {
    let placed = scenes::placed(camera);
    match suite {
        FrameSuite::Hard => Camera { ball_diameter: hard::DIAMETER, ..placed },
        FrameSuite::Scenes | FrameSuite::Empty => placed,
    }
}

/// Runs `detectors`, and what every tutorial does with OpenCV, over the pictures, each searched
/// like a first one. The detectors must be made for the [`suite_camera`] of `camera`;
/// `recorded` pictures, if any, are backgrounds of what needs some, else that is left out;
/// `progress` is told the name of each scene. OpenCV runs on one thread meanwhile.
///
/// # Errors
/// Where a scene could not be rendered (intrinsics that do not fit the pictures) or a detector
/// failed.
pub fn compare(
    camera: &Camera,
    recorded: &[RgbdFrame],
    detectors: &mut [Box<dyn BallDetector>],
    options: &VisionOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<VisionReport, VisionError> {
    check(options)?;
    let seen = suite_camera(options.suite, camera);
    let mut baselines: [Box<dyn BallDetector>; 2] =
        [Box::new(Hough(seen.clone())), Box::new(HsvMoments(seen))];
    let detectors: Vec<&mut Box<dyn BallDetector>> =
        detectors.iter_mut().chain(&mut baselines).collect();
    let _one = OneThread::new()?;
    let mut bench = Bench::new(camera, recorded, options, progress, detectors);
    if options.suite != FrameSuite::Hard {
        bench.scenes()?;
    }
    if options.suite != FrameSuite::Scenes && !recorded.is_empty() {
        bench.hard()?;
    }
    Ok(bench.report())
}

fn check(options: &VisionOptions) -> Result<(), VisionError> {
    if options.frames == 0 || options.empty == 0 {
        return Err(VisionError::Value {
            what: "the number of frames",
            value: 0.0,
            must: "1 or more",
        });
    }
    let room = f64::from(options.width.min(options.height)) / 6.0;
    if !(2.0..=room).contains(&options.radius) {
        let must = "at least 2 pixels and at most a sixth of the picture";
        return Err(VisionError::Value { what: "the ball's radius", value: options.radius, must });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
