//! `plumb-lab vision`: compares detectors on frames from a seed, and their times with the paper's
//! detector.

mod backdrops;
mod hard;
mod labelled;
pub mod pair;
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

use plumb_frame::source::BoxedError;
use plumb_vision::camera::Camera;
use plumb_vision::detect::BallDetector;
use plumb_vision::frame::RgbdFrame;

use run::Comparison;
use suites::each_kind;
use timing::OneThread;

pub use labelled::{GroundTruth, LabelledFrame};
pub use report::{DetectorReport, GroupReport, SceneReport, SceneTimes, VisionReport};
pub use rooms::FrameGroup;

named! {
    /// Set of frames to search.
    FrameSuite:
    Scenes "scenes" "rendered scenes, with and without a ball";
    Hard "hard" "recorded frames, difficult conditions, with a ball of 60 mm and without one";
    Rooms "rooms" "rooms of any colour, with depth, parts of it and none, with a ball and without";
    Disc "disc" "flat discs of 60 mm at a slant, without depth, in rooms, and rooms without one";
    Pair "pair" "two webcams as one depth camera: see `pair`; no single frames";
    Empty "empty" "the frames without a ball of the suites `scenes` and `hard`";
}

/// Options of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionOptions {
    /// Frames to search.
    pub suite: FrameSuite,
    /// Number of frames of each kind of scene with a ball.
    pub frames: usize,
    /// Number of frames of each kind of scene without a ball.
    pub empty: usize,
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
    /// 20 frames a scene, with and without a ball, at 640x480, balls of about 20 pixels radius.
    fn default() -> Self {
        let (suite, radius) = (FrameSuite::Scenes, 20.0);
        Self {
            suite,
            frames: 20,
            empty: 20,
            seed: 1,
            held_out: false,
            radius,
            width: 640,
            height: 480,
        }
    }
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
        FrameSuite::Hard | FrameSuite::Rooms | FrameSuite::Disc => {
            Camera { ball_diameter: placer::DIAMETER, ..placed }
        }
        FrameSuite::Scenes | FrameSuite::Pair | FrameSuite::Empty => placed,
    }
}

/// Runs `detectors` over the frames, each frame without knowledge of the one before. The detectors
/// must be made for the [`suite_camera`] of `camera`. Scenes with a recorded background are left
/// out if there are no `recorded` frames. Calls `progress` with the name of each scene. OpenCV runs
/// on one thread meanwhile.
///
/// # Errors
/// If the intrinsics do not fit the frames, or a detector fails.
pub fn compare(
    camera: &Camera,
    recorded: &[RgbdFrame],
    detectors: &mut [Box<dyn BallDetector>],
    options: &VisionOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<VisionReport, BoxedError> {
    let _one = OneThread::new()?;
    let mut comparison = Comparison::new(options, progress, detectors);
    each_kind(camera, recorded, options, &mut |kind, next| comparison.run(kind, next))?;
    Ok(comparison.report())
}

/// Calls `visit` with each frame of a suite and the name of its kind, in the order of [`compare`].
/// The frames are those that a comparison with the same options searches.
///
/// # Errors
/// If the intrinsics do not fit the frames.
pub fn each_frame(
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
    visit: &mut dyn FnMut(&'static str, &LabelledFrame),
) -> Result<(), BoxedError> {
    each_kind(camera, recorded, options, &mut |kind, next| {
        for _ in 0..kind.count {
            let Some(frame) = next()? else { break };
            visit(kind.name, &frame);
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests;
