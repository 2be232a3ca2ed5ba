//! The frame of the picture for a run of a rig with `[plane]`: the kept one, or two jogs.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use nalgebra::Vector2;
use plumb_calibrate::camera_text::with_plane;
use plumb_runtime::link::{Link, Transport};
use plumb_runtime::observer::{FrameRecord, Observer};
use plumb_runtime::rig::{PictureFrame, Rig};
use plumb_runtime::run::Summary;
use plumb_setup::two_jogs::{BoardHand, KeptFrame, Measured, rest, two_jogs};
use plumb_setup::watch::WatchParts;
use plumb_vision::camera::Intrinsics;
use plumb_vision::detect::DetectorKind;
use plumb_vision::image::ImageSize;

use crate::cli::choices;
use crate::cli::exit::{Failure, Unwritten, failed};
use crate::cli::old_file::{ask, write};
use crate::session::camera::RunCamera;
use crate::session::connection::RigBoard;

/// Question before the jogs.
const QUESTION: &str = "\
Two jogs come first: each motor pays out cable, at 50 steps/s and by 512 steps at most, until the
ball has moved by some 6 pixels. Keep a hand at the emergency button. Go on?";

/// What is there before the jogs.
pub(crate) struct Before {
    /// Frame of an earlier run.
    kept: Option<KeptFrame>,
    /// Whether a person has agreed to the jogs.
    is_agreed: bool,
}

impl Before {
    /// Reads the frame that is kept at `path`. Without one it asks for consent to the jogs with
    /// `board`.
    pub(crate) fn read(path: &Path, board: RigBoard<'_>, is_agreed: bool) -> Result<Self, Failure> {
        let kept = KeptFrame::read(path)?;
        if is_agreed || kept.is_some() {
            return Ok(Self { kept, is_agreed });
        }
        board.check_state()?;
        Ok(Self { kept, is_agreed: agree()? })
    }

    /// Jogs without asking, whatever an earlier run has measured.
    pub(crate) fn agreed() -> Self {
        Self { kept: None, is_agreed: true }
    }
}

/// Asks for consent to the jogs.
///
/// # Errors
/// Where a person says no, or nobody can be asked.
fn agree() -> Result<bool, Failure> {
    if ask(QUESTION)? { Ok(true) } else { Err(failed("nothing has moved")) }
}

/// A rig in the frame of its camera's picture.
pub(crate) struct InPicture {
    pub(crate) rig: Rig,
    /// Text of the camera file with the pose of the frame, for a recording.
    pub(crate) camera_text: String,
    /// Frame, to be kept for the next run.
    pub(crate) frame: KeptFrame,
}

/// Finds the frame of the picture for `rig`, and gives its pose to the `camera`, whose file has the
/// text `camera_text`: the frame of an earlier run where the ball hangs where that left it, else by
/// jogs with the motors of the configured board at `link`.
///
/// # Errors
/// Where the jogs are refused, or the board or the camera fails; the motors are then ramped down.
pub(crate) fn measure<T: Transport>(
    (rig, camera_text): (&Rig, &str),
    link: &mut Link<T>,
    (camera, detector): (&mut RunCamera, DetectorKind),
    before: Before,
    interrupted: &AtomicBool,
) -> Result<InPicture, Failure> {
    let kept = frame(link, (&mut *camera, detector), before, interrupted);
    let kept = kept.inspect_err(|_| link.abandon())?;
    let [width, height] = kept.size_px;
    let size = ImageSize { width, height };
    let frame = PictureFrame::of(&kept.jacobian_px(), width as f64).ok_or_else(no_picture)?;
    let rig = rig.in_picture((frame, kept.latency_s), (&camera.camera, size), kept.ball_px)?;
    if let Some(picture) = &rig.picture {
        camera.camera = picture.camera.clone();
    }
    if rig.plane.as_ref().is_some_and(|plane| plane.motors.is_none()) {
        tell!(
            "`plane.motors` is not set: targets may be in the middle third of the picture; with \
             the pixels of both motors, in all of it below them"
        );
    }
    let camera_text = with_plane(camera_text, &camera.camera.pose, "two jogs")?;
    Ok(InPicture { rig, camera_text, frame: kept })
}

/// Returns the frame of an earlier run, or that of new jogs.
fn frame<T: Transport>(
    link: &mut Link<T>,
    (camera, detector): (&mut RunCamera, DetectorKind),
    before: Before,
    interrupted: &AtomicBool,
) -> Result<KeptFrame, Failure> {
    let lens = camera.camera.intrinsics;
    let mut observers: Vec<&mut dyn Observer> = Vec::new();
    observers.extend(camera.follower.as_mut().map(|follower| follower as &mut dyn Observer));
    let mut parts = WatchParts {
        source: &mut *camera.source,
        detector: &mut *choices::detector(detector, &camera.camera),
        observers: &mut observers,
        progress: &mut |text| note!("{text}"),
        interrupted,
    };
    let mut hand = BoardHand::new(link, &mut parts, lens)?;
    if let Some(kept) = before.kept {
        let ball_px = pixel(&lens, rest(&mut hand)?)?;
        let size = hand.picture_size().ok_or_else(no_picture)?;
        if kept.is_of(size, ball_px) {
            note!("the frame of the last run fits: the ball hangs where it was left");
            return Ok(KeptFrame { ball_px, ..kept });
        }
        tell!("the ball does not hang where the last run left it: two jogs measure the picture");
    }
    if !before.is_agreed {
        agree()?;
    }
    let measured = two_jogs(&mut hand)?;
    tell_measured(&measured);
    let size = hand.picture_size().ok_or_else(no_picture)?;
    Ok(KeptFrame {
        jacobian_px: measured.jacobian_px.transpose().into(),
        latency_s: measured.latency_s,
        size_px: [size.width, size.height],
        ball_px: pixel(&lens, measured.ball_px)?,
    })
}

/// Returns the pixel of a place without the distortion of the lens, from the principal point.
fn pixel(lens: &Intrinsics, place: Vector2<f64>) -> Result<[f64; 2], Failure> {
    let ray = (place / lens.focal()).push(1.0);
    lens.project(&ray.into()).map(<[f64; 2]>::from).ok_or_else(no_picture)
}

/// Keeps the frame of a run for the next one: where the ball is seen at the end.
pub(crate) struct FrameKeeper {
    file: PathBuf,
    frame: KeptFrame,
    /// Frame to be kept, once the run has ended well.
    ended: Option<KeptFrame>,
}

impl FrameKeeper {
    /// Takes the frame of a run, to be kept in `file`. The former one is removed: a run that breaks
    /// leaves none.
    pub(crate) fn begin(file: PathBuf, frame: KeptFrame) -> Result<Self, Failure> {
        match fs::remove_file(&file) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(Unwritten::at(&file)(error).into())
            }
            _ => Ok(Self { file, frame, ended: None }),
        }
    }

    /// Writes the frame of a run that ended without a fault and with its motors at rest.
    pub(crate) fn keep(self) -> Result<(), Failure> {
        match self.ended {
            Some(frame) => write(&self.file, frame.text().as_bytes()),
            None => Ok(()),
        }
    }
}

impl Observer for FrameKeeper {
    fn frame(&mut self, record: &FrameRecord) {
        if let Some(ball) = &record.observation {
            self.frame.ball_px = [ball.circle.u, ball.circle.v];
        }
    }

    fn end(&mut self, summary: &Summary) {
        let is_well = summary.at_rest && summary.failure.is_none();
        let is_well = is_well && summary.ending.fault().is_none();
        self.ended = is_well.then_some(self.frame);
    }
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
