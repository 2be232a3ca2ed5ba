//! Two jogs before a run of a rig with `[plane]`: they give the frame of the picture.

use std::sync::atomic::AtomicBool;

use plumb_runtime::link::{Link, Transport};
use plumb_runtime::observer::Observer;
use plumb_runtime::rig::{PictureFrame, Rig};
use plumb_setup::two_jogs::{BoardHand, JogsError, Measured, two_jogs};
use plumb_setup::watch::WatchParts;
use plumb_vision::detect::DetectorKind;

use crate::cli::choices;
use crate::cli::exit::{Failure, failed};
use crate::session::camera::RunCamera;

/// Question before the jogs.
pub(crate) const QUESTION: &str = "\
Two jogs come first: each motor pays out cable, at 50 steps/s and by 512 steps at most, until the
ball has moved by some 6 pixels. Keep a hand at the emergency button. Go on?";

/// Jogs the motors of the configured board at `link` and returns `rig` in the frame of the picture.
/// The `camera` then has the pose of the frame.
pub(crate) fn measure<T: Transport>(
    rig: &Rig,
    link: &mut Link<T>,
    (camera, detector): (&mut RunCamera, DetectorKind),
    interrupted: &AtomicBool,
) -> Result<Rig, Failure> {
    let model = camera.camera.clone();
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(camera.follower.as_mut().map(|follower| follower as &mut dyn Observer));
    let mut parts = WatchParts {
        source: &mut *camera.source,
        detector: &mut *choices::detector(detector, &model),
        observers: &mut observers,
        progress: &mut |text| note!("{text}"),
        interrupted,
    };
    let mut hand = BoardHand::new(link, &mut parts, model.intrinsics)?;
    let measured = two_jogs(&mut hand).map_err(|error| match error {
        JogsError::Refused(refusal) => Failure::from(refusal),
        JogsError::Rig(error) => Failure::from(error),
    })?;
    let no_picture = || failed("no picture shows the ball");
    let size = hand.picture_size().ok_or_else(no_picture)?;
    let frame = PictureFrame::of(&measured.jacobian_px, size.width as f64);
    let frame = frame.ok_or_else(no_picture)?;
    tell_measured(&measured);
    let lens = model.intrinsics;
    let ball = measured.ball_px / lens.focal();
    let ball = lens.project(&ball.push(1.0).into()).map(<[f64; 2]>::from);
    let ball = ball.ok_or_else(no_picture)?;
    let rig = rig.in_picture((frame, measured.latency_s), (&model, size), ball)?;
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

/// Prints what the jogs have measured.
fn tell_measured(measured: &Measured) {
    let [[a, b], [c, d]] = measured.jacobian_px.transpose().into();
    note!(
        "a step moves the ball by ({a:+.2}, {c:+.2}) pixels with motor A and ({b:+.2}, {d:+.2}) \
         with motor B; the pictures are {:.0} ms late",
        measured.latency_s * 1e3
    );
}
