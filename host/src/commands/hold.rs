//! `plumb hold`: holds the ball where it is.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Parser;
use plumb_cameras::source::CameraSource;
use plumb_runtime::rig::Rig;
use plumb_vision::detect::BallDetector;

use super::rig_args::RigArg;
use super::run::{Common, Goal, drive};
use super::{Failure, failed, failed_because};

/// Longest search for the ball before a hold, seconds on the source's clock.
const SEARCH_S: f64 = 5.0;

/// Longest wait for a frame. After that the search looks for an interrupt.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// Hold the ball where it is, until Ctrl-C
///
/// The camera measures where the ball is. That place becomes the target, and the board corrects
/// every drift from it. At the end the motors stand and keep their current.
#[derive(Parser)]
#[command(after_help = examples!["plumb hold rig.toml"])]
pub(crate) struct Args {
    #[command(flatten)]
    rig: RigArg,
    #[command(flatten)]
    options: Common,
}

pub(crate) fn main(args: Args) -> Result<ExitCode, Failure> {
    let file = &args.rig.rig;
    drive(file, Rig::read(file)?, &Goal::PresentPlace, &args.options)
}

/// Returns the place of the ball in the first frame that shows it, metres in the rig frame.
///
/// # Errors
/// Where no frame shows the ball within [`SEARCH_S`], a frame fails, or `interrupted` is set.
pub(super) fn find_ball(
    source: &mut dyn CameraSource,
    detector: &mut dyn BallDetector,
    interrupted: &AtomicBool,
) -> Result<[f64; 3], Failure> {
    let begin = source.now();
    while source.now() - begin < SEARCH_S {
        if interrupted.load(Ordering::Relaxed) {
            return Err(failed("interrupted before the ball was found: the board has no target"));
        }
        if !source.wait(MAX_WAIT) {
            continue;
        }
        let Some(frame) = source.next_frame().map_err(failed_because)? else { break };
        let ball = detector.detect(&frame).map_err(failed_because)?;
        if let Some(place) = ball.and_then(|ball| ball.position) {
            return Ok(place.mean.into());
        }
    }
    Err(failed("the camera does not show the ball, so that its place cannot be held"))
}

#[cfg(test)]
mod tests {
    use plumb_cameras::source::SourceError;
    use plumb_vision::detect::DetectError;
    use plumb_vision::frame::RgbdFrame;
    use plumb_vision::observation::BallObservation;

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
