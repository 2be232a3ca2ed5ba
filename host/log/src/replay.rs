//! Detection on a recording: a CSV row for each frame (`plumb replay`), and images of the
//! detector's stages (`--debug`).
//!
//! | column | meaning |
//! |---|---|
//! | `time_s` | time stamp of the colour image, seconds |
//! | `u_px`, `v_px`, `radius_px` | centre and radius of the ball, pixels |
//! | `depth_m` | depth of the ball's centre along the optical axis, metres |
//! | `position_m_x`, `position_m_y`, `position_m_z` | centre of the ball in the rig frame, metres |
//! | `score` | score of the detector |
//!
//! Unknown fields are empty: all after `time_s` if the frame is broken or has no ball, and the
//! depth and the position if the ball has too little depth.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use plumb_cameras::png::{self, PngError};
use plumb_frame::camera::Camera;
use plumb_frame::detect::{BallDetector, DetectError, StageImage};
use plumb_frame::frame::RgbdFrame;
use plumb_frame::observation::BallObservation;
use plumb_frame::source::{CameraSource, SourceError};
use plumb_runtime::doubt::{DepthComparison, Doubt};
use thiserror::Error;

/// Header of the CSV: the names of the columns.
const HEADER: [&str; 9] = [
    "time_s",
    "u_px",
    "v_px",
    "radius_px",
    "depth_m",
    "position_m_x",
    "position_m_y",
    "position_m_z",
    "score",
];

/// Error that ends a replay early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The rows could not be written.
    #[error("the rows cannot be written")]
    Write(#[from] io::Error),
    /// The images of the stages could not be written.
    #[error("the images of the stages cannot be written")]
    Debug(#[from] DebugError),
}

impl ReplayError {
    /// Returns whether the reader of the rows has closed its pipe.
    pub fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::Write(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// Problem with one frame or one line of a list. The replay continues.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The frame could not be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The detector failed on the frame.
    #[error("the frame at {time:.6} s")]
    Detect {
        /// Time stamp of the frame, seconds.
        time: f64,
        /// Error of the detector.
        #[source]
        error: DetectError,
    },
    /// The two depths of the ball differ; told once.
    #[error("{}", .0.with_advice())]
    Doubt(Doubt),
    /// The frame has no pixel of depth, for example because no depth image is near in time.
    #[error("the frame at {time:.6} s: no depth image within 20 ms, or an empty one")]
    NoDepth {
        /// Time stamp of the frame, seconds.
        time: f64,
    },
}

/// Counts of a replay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReplayOutcome {
    /// Frames in the recording, including broken ones: the number of rows.
    pub frames: usize,
    /// Frames with a ball.
    pub detected: usize,
    /// Frames with a ball whose position is known.
    pub located: usize,
    /// Frames without depth.
    pub without_depth: usize,
    /// Frames on which reading or detection failed, and lines that describe no frame.
    pub broken: usize,
}

/// Runs `detector` over the frames of `source` until it ends. Writes a row for each frame to `out`
/// and flushes it, and images of the detector's stages to `debug`. Problems with single frames go
/// to `report`. Calls `progress` after each row with the counts so far.
///
/// # Errors
/// Returns an error if `out` or the images cannot be written.
pub fn replay(
    source: &mut dyn CameraSource,
    camera: &Camera,
    detector: &mut dyn BallDetector,
    out: impl Write,
    debug: Option<&DebugFolder>,
    mut report: impl FnMut(&Problem),
    mut progress: impl FnMut(&ReplayOutcome),
) -> Result<ReplayOutcome, ReplayError> {
    let mut rows = csv::Writer::from_writer(out);
    rows.write_record(HEADER).map_err(io::Error::from)?;
    let (mut outcome, mut depths) = (ReplayOutcome::default(), DepthComparison::default());
    loop {
        let (time, ball) = match source.next_frame() {
            Ok(None) => break,
            Ok(Some(frame)) => {
                let ball = detect(&frame, detector, &mut outcome, debug, &mut report)?;
                if let Some(doubt) = depths.look(detector, &frame, ball.as_ref()) {
                    report(&Problem::Doubt(doubt));
                }
                (Some(frame.time()), ball)
            }
            Err(error) => {
                let (time, last) = (error.stamp(), error.is_over());
                outcome.broken += 1;
                report(&error.into());
                if last {
                    break;
                }
                (time, None)
            }
        };
        if let Some(time) = time {
            outcome.frames += 1;
            rows.write_record(row(time, ball.as_ref(), camera)).map_err(io::Error::from)?;
            rows.flush()?;
            progress(&outcome);
        }
    }
    rows.flush()?;
    Ok(outcome)
}

/// Runs the detector on one frame, and counts the result in `outcome`.
fn detect(
    frame: &RgbdFrame,
    detector: &mut dyn BallDetector,
    outcome: &mut ReplayOutcome,
    debug: Option<&DebugFolder>,
    report: &mut impl FnMut(&Problem),
) -> Result<Option<BallObservation>, DebugError> {
    let time = frame.time();
    if frame.depth().pixels().iter().all(|&depth| depth == 0) {
        outcome.without_depth += 1;
        // Of a camera without depth it is no problem.
        if frame.intrinsics().has_depth() {
            report(&Problem::NoDepth { time });
        }
    }
    let found = match debug {
        Some(_) => detector.detect_with_stages(frame),
        None => detector.detect(frame).map(|ball| (ball, Vec::new())),
    };
    let (ball, stages) = found.unwrap_or_else(|error| {
        outcome.broken += 1;
        report(&Problem::Detect { time, error });
        Default::default()
    });
    if let Some(debug) = debug {
        debug.write(outcome.frames, &stages)?;
    }
    outcome.detected += usize::from(ball.is_some());
    outcome.located += usize::from(ball.is_some_and(|ball| ball.position.is_some()));
    Ok(ball)
}

/// Returns the fields of a row in the order of [`HEADER`]: pixels to 0.001, metres to 0.00001, the
/// score to 0.0001.
fn row(time: f64, ball: Option<&BallObservation>, camera: &Camera) -> [String; 9] {
    let field = |value: Option<f64>, digits: usize| {
        value.map(|x| format!("{x:.digits$}")).unwrap_or_default()
    };
    let circle = ball.map(|ball| ball.circle);
    let mean = ball.and_then(|ball| ball.position).map(|position| position.mean);
    let position = |axis: usize| mean.map(|mean| mean[axis]);
    [
        field(Some(time), 6),
        field(circle.map(|c| c.u), 3),
        field(circle.map(|c| c.v), 3),
        field(circle.map(|c| c.radius), 3),
        field(mean.map(|mean| camera.depth_of(&mean)), 5),
        field(position(0), 5),
        field(position(1), 5),
        field(position(2), 5),
        field(ball.map(|ball| ball.score), 4),
    ]
}

/// A folder with an image of each stage for each frame: `000042-2-outline.png` is the second stage
/// of frame 42. Frames are numbered from 0, as the rows of the replay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DebugFolder {
    path: PathBuf,
}

/// Reasons why the images could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DebugError {
    /// The folder could not be made.
    #[error("cannot make the folder {}", .path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The folder is not empty.
    #[error("{} is not empty: give another folder", .path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// An image could not be written.
    #[error(transparent)]
    Png(#[from] PngError),
}

impl DebugFolder {
    /// Makes the folder, or takes an empty one.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be made or is not empty.
    pub fn create(path: &Path) -> Result<Self, DebugError> {
        let failed = |source| DebugError::Folder { path: path.to_owned(), source };
        fs::create_dir_all(path).map_err(failed)?;
        if fs::read_dir(path).map_err(failed)?.next().is_some() {
            return Err(DebugError::NotEmpty { path: path.to_owned() });
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Writes the images of one frame.
    fn write(&self, number: usize, stages: &[StageImage]) -> Result<(), DebugError> {
        for StageImage { name, image } in stages {
            png::save(&self.path.join(format!("{number:06}-{name}.png")), image)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
