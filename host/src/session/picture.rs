//! Two jogs before a run of a rig with `[plane]`: they give the frame of the picture.

use std::sync::atomic::AtomicBool;

use plumb_runtime::link::{Link, Transport};
use plumb_runtime::observer::Observer;
use plumb_runtime::rig::{PictureFrame, Rig};
use plumb_setup::two_jogs::{BoardHand, JogsError, Measured, two_jogs};
use plumb_setup::watch::WatchParts;
use plumb_vision::detect::DetectorKind;
use plumb_vision::image::ImageSize;

use crate::cli::choices;
use crate::cli::exit::{Failure, failed};
use crate::session::camera::RunCamera;

/// Question before the jogs.
pub(crate) const QUESTION: &str = "\
Two jogs come first: each motor pays out cable, at 50 steps/s and by 512 steps at most, until the
ball has moved by some 6 pixels. Keep a hand at the emergency button. Go on?";

/// Jogs the motors of the configured board at `link` and returns `rig` in the frame of the picture.
/// The `camera` then has the pose of the frame.
///
/// # Errors
/// Where the jogs are refused, or the board or the camera fails; the motors are then ramped down.
pub(crate) fn measure<T: Transport>(
    rig: &Rig,
    link: &mut Link<T>,
    (camera, detector): (&mut RunCamera, DetectorKind),
    interrupted: &AtomicBool,
) -> Result<Rig, Failure> {
    let jogged = jog(link, (&mut *camera, detector), interrupted);
    let Jogged { measured, size } = jogged.inspect_err(|_| link.abandon())?;
    tell_measured(&measured);
    let lens = camera.camera.intrinsics;
    let ball = (measured.ball_px / lens.focal()).push(1.0);
    let ball = lens.project(&ball.into()).map(<[f64; 2]>::from);
    let frame = PictureFrame::of(&measured.jacobian_px, size.width as f64);
    let (ball, frame) = ball.zip(frame).ok_or_else(no_picture)?;
    let frame = (frame, measured.latency_s);
    let rig = rig.in_picture(frame, (&camera.camera, size), ball)?;
    if let Some(picture) = &rig.picture {
        camera.camera = picture.camera.clone();
    }
    if rig.plane.as_ref().is_some_and(|plane| plane.motors.is_none()) {
        tell!(
            "`plane.motors` is not set: targets may be in the middle third of the picture; with \
             the pixels of both motors, in all of it below them"
        );
    }
    Ok(rig)
}

/// What the jogs have measured, and the size of the pictures.
struct Jogged {
    measured: Measured,
    size: ImageSize,
}

/// Jogs the motors before the `camera`.
fn jog<T: Transport>(
    link: &mut Link<T>,
    (camera, detector): (&mut RunCamera, DetectorKind),
    interrupted: &AtomicBool,
) -> Result<Jogged, Failure> {
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(camera.follower.as_mut().map(|follower| follower as &mut dyn Observer));
    let mut parts = WatchParts {
        source: &mut *camera.source,
        detector: &mut *choices::detector(detector, &camera.camera),
        observers: &mut observers,
        progress: &mut |text| note!("{text}"),
        interrupted,
    };
    let mut hand = BoardHand::new(link, &mut parts, camera.camera.intrinsics)?;
    let measured = two_jogs(&mut hand).map_err(|error| match error {
        JogsError::Refused(refusal) => Failure::from(refusal),
        JogsError::Rig(error) => Failure::from(error),
    })?;
    let size = hand.picture_size().ok_or_else(no_picture)?;
    Ok(Jogged { measured, size })
}

/// Returns the failure of jogs without a picture.
fn no_picture() -> Failure {
    failed("no picture shows the ball")
}

/// Prints what the jogs have measured.
fn tell_measured(measured: &Measured) {
    let [[a, b], [c, d]] = measured.jacobian_px.transpose().into();
    note!(
        "a step moves the ball by ({a:+.2}, {c:+.2}) pixels with motor A and ({b:+.2}, {d:+.2}) \
         with motor B; the pictures are {:.0} ms late",
        measured.latency_s * 1e3
    );
}
