//! `plumb-lab vision`: compares detectors on frames from a seed, and their times with the paper's
//! detector.

mod backdrops;
mod baselines;
mod hard;
mod labelled;
mod placer;
mod report;
mod rooms;
mod run;
mod scene_kind;
mod scenes;
mod stats;
mod suites;
mod table;
mod timing;

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use plumb_frame::source::BoxedError;
use plumb_sim::synthetic::SyntheticError;
use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use thiserror::Error;

use crate::UnknownName;
use baselines::{Hough, HsvMoments};
use run::Comparison;
use suites::each_kind;
use timing::OneThread;

pub use labelled::{GroundTruth, LabelledFrame};
pub use report::{DetectorReport, GroupReport, SceneReport, SceneTimes, VisionReport};
pub use rooms::FrameGroup;

/// Set of frames to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameSuite {
    /// Rendered scenes, with and without a ball.
    Scenes,
    /// Recorded frames with a ball of 60 mm under difficult conditions, and without a ball.
    Hard,
    /// Rendered and recorded rooms of any colour with a ball of 60 mm, with depth, with parts of it
    /// and without, and without a ball.
    Rooms,
    /// The frames without a ball of the suites `scenes` and `hard`.
    Empty,
}

impl FrameSuite {
    /// Every suite.
    pub const ALL: [Self; 4] = [Self::Scenes, Self::Hard, Self::Rooms, Self::Empty];

    /// Returns the name in options.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Scenes => "scenes",
            Self::Hard => "hard",
            Self::Rooms => "rooms",
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

/// Options of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionOptions {
    /// Frames to search.
    pub suite: FrameSuite,
    /// Number of frames of each kind of scene with a ball; at least 1.
    pub frames: usize,
    /// Number of frames of each kind of scene without a ball; at least 1.
    pub empty: usize,
    /// Number of balls composited into recorded frames, if there are any.
    pub recorded_balls: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether the suite `rooms` draws its held-out frames: other random numbers and other rendered
    /// rooms. The caller holds out recorded frames ([`is_held_out`]).
    pub held_out: bool,
    /// Radius of the ball, pixels, ±15 % unless the scene has another.
    pub radius: f64,
    /// Width of the rendered frames, pixels.
    pub width: u16,
    /// Height of the rendered frames, pixels.
    pub height: u16,
}

impl Default for VisionOptions {
    /// 20 frames a scene, with and without a ball, at 640x480, balls of about 20 pixels radius, 60
    /// balls in recorded frames.
    fn default() -> Self {
        let (suite, radius) = (FrameSuite::Scenes, 20.0);
        Self {
            suite,
            frames: 20,
            empty: 20,
            recorded_balls: 60,
            seed: 1,
            held_out: false,
            radius,
            width: 640,
            height: 480,
        }
    }
}

/// Reason that a comparison gave no result.
#[derive(Debug, Error)]
pub enum VisionError {
    /// A scene could not be rendered.
    #[error(transparent)]
    Scene(#[from] SyntheticError),
    /// A detector failed on a frame.
    #[error("detector {name}, scene \"{scene}\"")]
    Detect {
        /// Name of the detector.
        name: &'static str,
        /// Name of the scene.
        scene: &'static str,
        /// Error of the detector.
        #[source]
        error: DetectError,
    },
    /// A picture could not be compressed to a JPEG and back.
    #[error("a picture cannot be compressed")]
    Compress(#[source] BoxedError),
    /// OpenCV refused an operation.
    #[error("OpenCV refused an operation")]
    OpenCv(#[from] opencv::Error),
    /// An invalid number.
    #[error("bench vision: {what} is {value}, but must be {must}")]
    Value {
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its valid range.
        must: &'static str,
    },
}

/// Returns whether a recorded frame is kept apart from those that detectors are made with: every
/// fourth frame of a recording is. `number` counts the recording's frames from 0.
pub const fn is_held_out(number: usize) -> bool {
    number % 4 == 3
}

/// Returns the camera of the frames of `suite`: the intrinsics and the ball's hue of `camera`, at
/// the pose that the scenes assume, with the ball of the suite.
pub fn suite_camera(suite: FrameSuite, camera: &Camera) -> Camera {
    let placed = backdrops::placed(camera);
    match suite {
        FrameSuite::Hard | FrameSuite::Rooms => {
            Camera { ball_diameter: placer::DIAMETER, ..placed }
        }
        FrameSuite::Scenes | FrameSuite::Empty => placed,
    }
}

/// Runs `detectors` and two common OpenCV methods over the frames, each frame without knowledge of
/// the one before. The detectors must be made for the [`suite_camera`] of `camera`. Scenes with a
/// recorded background are left out if there are no `recorded` frames. Calls `progress` with the
/// name of each scene. OpenCV runs on one thread meanwhile.
///
/// # Errors
/// If an option is out of range, the intrinsics do not fit the frames, or a detector fails.
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
    let mut comparison = Comparison::new(options, progress, detectors);
    each_kind(camera, recorded, options, &mut |kind, next| comparison.run(kind, next))?;
    Ok(comparison.report())
}

/// Calls `visit` with each frame of a suite and the name of its kind, in the order of [`compare`].
/// The frames are those that a comparison with the same options searches.
///
/// # Errors
/// If an option is out of range, or the intrinsics do not fit the frames.
pub fn each_frame(
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
    visit: &mut dyn FnMut(&'static str, &LabelledFrame),
) -> Result<(), VisionError> {
    check(options)?;
    each_kind(camera, recorded, options, &mut |kind, next| {
        for _ in 0..kind.count {
            let Some(frame) = next()? else { break };
            visit(kind.name, &frame);
        }
        Ok(())
    })
}

/// Checks the options.
fn check(options: &VisionOptions) -> Result<(), VisionError> {
    if options.frames == 0 || options.empty == 0 {
        return Err(VisionError::Value {
            what: "the number of frames",
            value: 0.0,
            must: "1 or more",
        });
    }
    let max = f64::from(options.width.min(options.height)) / 6.0;
    if !(2.0..=max).contains(&options.radius) {
        let must = "at least 2 pixels and at most a sixth of the frame's shorter side";
        return Err(VisionError::Value { what: "the ball's radius", value: options.radius, must });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
