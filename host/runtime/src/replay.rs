//! Detection on a recording: a CSV row for each frame (`plumb replay`).
//!
//! | column | meaning |
//! |---|---|
//! | `t` | the colour picture's time stamp, seconds |
//! | `u`, `v`, `radius` | the ball's centre and radius, pixels |
//! | `depth` | of its centre along the optical axis, metres |
//! | `x`, `y`, `z` | its centre in the rig frame, metres |
//! | `score` | the detector's |
//!
//! Fields that are not known are empty: all after `t` where there is no ball or the frame is
//! broken, `depth`, `x`, `y` and `z` where the ball has too little depth.

mod debug;

use std::io::{self, Write};
use std::path::Path;

use plumb_cameras::source::tum::{TumError, TumFolder};
use plumb_cameras::source::{CameraSource, SourceError};
use plumb_vision::camera::Camera;
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::frame::RgbdFrame;
use plumb_vision::observation::BallObservation;
use thiserror::Error;

pub use debug::{DebugError, DebugFolder};

/// The CSV's first line, field by field.
pub const HEADER: [&str; 9] = ["t", "u", "v", "radius", "depth", "x", "y", "z", "score"];

/// Why a replay ended early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The recording could not be opened.
    #[error(transparent)]
    Open(#[from] TumError),
    /// The rows could not be written.
    #[error("the rows cannot be written: {0}")]
    Write(#[from] csv::Error),
    /// The images of the stages could not be written.
    #[error("the images of the stages: {0}")]
    Debug(#[from] DebugError),
}

impl ReplayError {
    /// Whether the rows were written to a pipe whose reader has closed it.
    pub fn is_closed_pipe(&self) -> bool {
        let Self::Write(error) = self else { return false };
        let csv::ErrorKind::Io(error) = error.kind() else { return false };
        error.kind() == io::ErrorKind::BrokenPipe
    }
}

/// What went wrong with one frame, or one line of a list; the replay goes on.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// It could not be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// It could not be searched.
    #[error("the frame at {time:.6} s: {error}")]
    Detect {
        /// Its time stamp, seconds.
        time: f64,
        /// What the detector said.
        error: DetectError,
    },
    /// It has colour but not one pixel of depth (no depth picture near in time, for example).
    #[error("the frame at {time:.6} s: no depth picture within 20 ms, or an empty one")]
    NoDepth {
        /// Its time stamp, seconds.
        time: f64,
    },
}

/// What a replay found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReplayOutcome {
    /// Frames in the recording, broken ones too: rows written.
    pub frames: usize,
    /// Frames with a ball.
    pub detected: usize,
    /// Frames with a ball whose position is known.
    pub located: usize,
    /// Frames without any depth.
    pub without_depth: usize,
    /// Frames that could not be read or searched, and lines that are no frame.
    pub broken: usize,
}

/// Runs `detector` over the TUM RGB-D recording in `folder`, taken by `camera`, and writes a row a
/// colour frame to `out`, at once. What is wrong with single frames goes to `report` and does not
/// end it.
///
/// # Errors
/// Where the recording's lists cannot be read or `out` cannot be written.
pub fn replay_folder(
    folder: &Path,
    camera: &Camera,
    detector: &mut dyn BallDetector,
    out: impl Write,
    report: impl FnMut(&Problem),
) -> Result<ReplayOutcome, ReplayError> {
    let mut source = TumFolder::open(folder, camera.intrinsics)?;
    replay(&mut source, camera, detector, out, None, report)
}

/// As [`replay_folder`], on any source that comes to an end, or to an error that is its end. Images
/// of the detector's stages go to `debug`.
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
) -> Result<ReplayOutcome, ReplayError> {
    let mut rows = csv::Writer::from_writer(out);
    rows.write_record(HEADER)?;
    let mut outcome = ReplayOutcome::default();
    loop {
        let (time, ball) = match source.next_frame() {
            Ok(None) => break,
            Ok(Some(frame)) => {
                let ball = look(&frame, detector, &mut outcome, debug, &mut report)?;
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
            rows.write_record(row(time, ball.as_ref(), camera))?;
            rows.flush().map_err(csv::Error::from)?;
        }
    }
    rows.flush().map_err(csv::Error::from)?;
    Ok(outcome)
}

/// Looks for the ball in one frame, and counts the result in `outcome`.
fn look(
    frame: &RgbdFrame,
    detector: &mut dyn BallDetector,
    outcome: &mut ReplayOutcome,
    debug: Option<&DebugFolder>,
    report: &mut impl FnMut(&Problem),
) -> Result<Option<BallObservation>, DebugError> {
    let time = frame.time();
    if frame.depth().pixels().iter().all(|&depth| depth == 0) {
        outcome.without_depth += 1;
        report(&Problem::NoDepth { time });
    }
    let (ball, trace) = detector.detect_traced(frame).unwrap_or_else(|error| {
        outcome.broken += 1;
        report(&Problem::Detect { time, error });
        Default::default()
    });
    if let Some(debug) = debug {
        debug.write(outcome.frames, frame, &trace, ball.as_ref())?;
    }
    outcome.detected += usize::from(ball.is_some());
    outcome.located += usize::from(ball.is_some_and(|ball| ball.position.is_some()));
    Ok(ball)
}

/// The fields of a row, in the order of [`HEADER`]: pixels to 0.001, metres to 0.00001, the score
/// to 0.0001.
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

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use opencv::core::{CV_8UC3, CV_16UC1, Mat, Scalar};
    use opencv::imgcodecs::imwrite_def;
    use plumb_vision::camera::Intrinsics;
    use plumb_vision::observation::Circle;

    use super::*;

    /// Sees a ball where the first pixel's blue is 1, fails where it is 2.
    struct Scripted;

    impl BallDetector for Scripted {
        fn name(&self) -> &'static str {
            "scripted"
        }

        fn detect(&mut self, frame: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
            match frame.colour().pixels()[0][0] {
                1 => {
                    let circle = Circle::rough(15.5, 11.5, 8.0);
                    Ok(Some(BallObservation::new(circle, 0.75, frame, &camera())))
                }
                2 => Err(DetectError::processing("scripted")),
                _ => Ok(None),
            }
        }
    }

    fn camera() -> Camera {
        let intrinsics =
            Intrinsics { fx: 200.0, fy: 200.0, cx: 15.5, cy: 11.5, depth_scale: 1000.0 };
        let pose = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::zeros());
        Camera { intrinsics, pose, ball_diameter: 0.04, ball_hue: 0.0 }
    }

    fn recording() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write(
            "rgb.txt",
            "# t\n0.000000 0.png\n0.033333 1.png\n0.066667 gone.png\n0.1 2.png\n0.2 1.png\n",
        );
        write("depth.txt", "0.001 d.png\n0.034 d.png\n0.066667 d.png\n0.1 d.png\nx y\n");
        let picture = |name: &str, typ: i32, value: f64| {
            let mat = Mat::new_rows_cols_with_default(24, 32, typ, Scalar::all(value)).unwrap();
            imwrite_def(folder.path().join(name).to_str().unwrap(), &mat).unwrap();
        };
        for value in 0..3 {
            picture(&format!("{value}.png"), CV_8UC3, f64::from(value));
        }
        picture("d.png", CV_16UC1, 500.0);
        folder
    }

    #[test]
    fn there_is_a_row_a_colour_frame_and_every_problem_is_reported() {
        let (mut out, mut problems) = (Vec::new(), Vec::new());
        let folder = recording();
        let report = |p: &Problem| problems.push(p.to_string());
        let outcome =
            replay_folder(folder.path(), &camera(), &mut Scripted, &mut out, report).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "t,u,v,radius,depth,x,y,z,score");
        assert_eq!(lines[1], "0.000000,,,,,,,,");
        assert!(lines[2].starts_with("0.033333,15.500,11.500,8.000,0.51"), "{}", lines[2]);
        assert!(
            lines[2].contains(",1.00000,2.00000,3.51") && lines[2].ends_with(",0.7500"),
            "{}",
            lines[2]
        );
        assert_eq!(lines[3], "0.066667,,,,,,,,");
        assert_eq!(lines[4], "0.100000,,,,,,,,");
        assert_eq!(lines[5], "0.200000,15.500,11.500,8.000,,,,,0.7500");
        assert_eq!(lines.len(), 6);
        let expected =
            ReplayOutcome { frames: 5, detected: 2, located: 1, without_depth: 1, broken: 3 };
        assert_eq!(outcome, expected);
        let named = ["depth.txt:5", "gone.png", "scripted", "0.200000 s: no depth"];
        assert_eq!(problems.len(), named.len(), "{problems:?}");
        for (problem, name) in problems.iter().zip(named) {
            assert!(problem.contains(name), "{name} in {problem}");
        }
    }

    #[test]
    fn a_pipe_that_closes_ends_it_with_an_error() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let folder = recording();
        let outcome = replay_folder(folder.path(), &camera(), &mut Scripted, Closed, |_| ());
        assert!(outcome.as_ref().is_err_and(ReplayError::is_closed_pipe), "{outcome:?}");
    }
}
