//! The place of the ball before a hold.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use plumb_cameras::camera_file::COMPARE_BALL;
use plumb_frame::source::CameraSource;
use plumb_runtime::doubt::DepthComparison;
use plumb_vision::detect::BallDetector;

use crate::cli::exit::{Failure, failed};

/// Longest search for the ball before a hold, seconds on the source's clock.
const SEARCH_S: f64 = 5.0;

/// Longest wait for a frame. After that the search looks for an interrupt.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// Returns the place of the ball in the first frame that shows it, metres in the rig frame. Frames
/// that are lost or cannot be searched are left out.
///
/// # Errors
/// Where no frame shows the ball within [`SEARCH_S`], the camera is gone, or `interrupted` is set.
pub(crate) fn find_ball(
    source: &mut dyn CameraSource,
    detector: &mut dyn BallDetector,
    interrupted: &AtomicBool,
) -> Result<[f64; 3], Failure> {
    let begin = source.now();
    let (mut lost, mut depths) = (None, DepthComparison::default());
    while source.now() - begin < SEARCH_S {
        if interrupted.load(Ordering::Relaxed) {
            return Err(failed("interrupted before the ball was found: the board has no target"));
        }
        if !source.wait(MAX_WAIT) {
            continue;
        }
        let frame = match source.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) => break,
            Err(error) if error.is_over() => return Err(error.into()),
            Err(error) => {
                lost = Some(Failure::from(error));
                continue;
            }
        };
        match detector.detect(&frame) {
            Ok(ball) => {
                depths.look(detector, &frame, ball.as_ref());
                if let Some(place) = ball.and_then(|ball| ball.position) {
                    return Ok(place.mean.into());
                }
                lost = None;
            }
            Err(error) => lost = Some(Failure::from(error)),
        }
    }
    let unseen = || {
        failed(format!(
            "the camera does not show the ball, so that its place cannot be held; {}",
            match depths.doubt() {
                Some(doubt) => doubt.with_advice(),
                None => format!("hang it into the picture; {COMPARE_BALL}"),
            }
        ))
    };
    // A camera whose last frames are lost does not tell where the ball is.
    Err(lost.unwrap_or_else(unseen))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

    use nalgebra::{Matrix3, Point3};
    use plumb_frame::source::SourceError;
    use plumb_vision::camera::Intrinsics;
    use plumb_vision::detect::DetectError;
    use plumb_vision::frame::RgbdFrame;
    use plumb_vision::image::Image;
    use plumb_vision::observation::{BallObservation, Circle, Gaussian3};

    use super::*;

    /// Camera that delivers no frame; its clock runs while the search waits.
    struct Stalled {
        now: f64,
    }

    impl CameraSource for Stalled {
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
            panic!("the search waits for ever");
        }

        fn now(&self) -> f64 {
            self.now
        }

        fn is_live(&self) -> bool {
            true
        }

        fn wait(&mut self, limit: Duration) -> bool {
            self.now += limit.as_secs_f64();
            false
        }
    }

    struct NoBall;

    impl BallDetector for NoBall {
        fn name(&self) -> &'static str {
            "no ball"
        }

        fn detect(&mut self, _: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
            Ok(None)
        }
    }

    /// Returns the message of a search that fails, and the time of its end.
    fn search(is_interrupted: bool) -> (String, f64) {
        let mut source = Stalled { now: 0.0 };
        let found = find_ball(&mut source, &mut NoBall, &AtomicBool::new(is_interrupted));
        let failure = found.expect_err("there is no ball");
        (failure.message(), source.now)
    }

    /// Camera at 30 frames/s that loses this number of frames, and then ends or goes on.
    struct Lossy {
        lost: u32,
        frames: u32,
        is_gone: bool,
    }

    impl CameraSource for Lossy {
        fn next_frame(&mut self) -> Result<Option<RgbdFrame>, SourceError> {
            self.frames += 1;
            if self.frames <= self.lost {
                return Err(SourceError::new("a torn frame"));
            }
            if self.is_gone {
                return Err(SourceError::over("unplugged"));
            }
            let intrinsics = Intrinsics {
                fx: 1.0,
                fy: 1.0,
                cx: 0.5,
                cy: 0.5,
                depth_scale: 1000.0,
                distortion: None,
            };
            let (colour, depth) = (Image::filled(2, 2, [1; 3]), Image::filled(2, 2, 1));
            Ok(Some(RgbdFrame::new(self.now(), colour, depth, intrinsics).unwrap()))
        }

        fn now(&self) -> f64 {
            f64::from(self.frames) / 30.0
        }

        fn is_live(&self) -> bool {
            true
        }

        fn wait(&mut self, _: Duration) -> bool {
            true
        }
    }

    /// Detector that cannot search its first frame, and finds a ball in the next.
    struct Late(bool);

    impl BallDetector for Late {
        fn name(&self) -> &'static str {
            "late"
        }

        fn detect(&mut self, _: &RgbdFrame) -> Result<Option<BallObservation>, DetectError> {
            if !std::mem::replace(&mut self.0, true) {
                return Err(DetectError::processing("no memory"));
            }
            let mean = Point3::new(0.4, 0.3, 0.2);
            let position = Gaussian3 { mean, covariance: Matrix3::identity() };
            let circle = Circle::rough(1.0, 1.0, 1.0);
            Ok(Some(BallObservation {
                stamp: 0.0,
                circle,
                score: 1.0,
                position: Some(position),
                depths: None,
            }))
        }
    }

    #[test]
    fn bad_frames_do_not_end_the_search() {
        let mut source = Lossy { lost: 3, frames: 0, is_gone: false };
        let found = find_ball(&mut source, &mut Late(false), &AtomicBool::new(false));
        assert_eq!(found.unwrap_or_else(|error| panic!("{}", error.message())), [0.4, 0.3, 0.2]);
    }

    #[test]
    fn a_search_without_a_good_frame_names_the_cause() {
        let search = |lost, is_gone| {
            let mut source = Lossy { lost, frames: 0, is_gone };
            let found = find_ball(&mut source, &mut NoBall, &AtomicBool::new(false));
            (found.expect_err("there is no ball").message(), source.frames)
        };
        let (message, frames) = search(1000, false);
        assert!(message.contains("a torn frame") && frames > 100, "{message}");
        let (message, frames) = search(2, true);
        assert!(message.contains("unplugged") && frames == 3, "{message}");
    }

    #[test]
    fn an_interrupted_search_claims_nothing_about_the_ball() {
        let (message, time) = search(true);
        assert!(message.starts_with("interrupted"), "{message}");
        assert!(time < 0.1, "ended after {time} s");
    }

    #[test]
    fn a_stalled_camera_ends_the_search_in_time() {
        let (message, time) = search(false);
        assert!(message.contains("does not show the ball"), "{message}");
        assert!((time - SEARCH_S).abs() < 0.1, "ended after {time} s");
    }
}
