//! A run: looks, tells the board, and keeps what happened, until the ball is at its target.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use nalgebra::Point3;
use plumb_cameras::source::{CameraSource, SourceError};
use plumb_protocol::message::{Fault, State, Telemetry};
use plumb_protocol::units::{Covariance, Point, Rate, Steps16};
use plumb_vision::detect::{BallDetector, DetectError};
use plumb_vision::observation::{BallObservation, Gaussian3};
use thiserror::Error;

use crate::link::{Link, LinkError, Transport};
use crate::run::{Row, RunError, RunFolder};

/// Hears where the board says that its motors are (full steps since its start).
pub type Follow<'a> = &'a mut dyn FnMut([f64; 3]) -> Result<(), SourceError>;

/// What a run works with.
pub struct Rig<'a, S, T> {
    /// Sees.
    pub source: &'a mut S,
    /// Finds the ball.
    pub detector: &'a mut dyn BallDetector,
    /// The configured board.
    pub link: &'a mut Link<T>,
    /// Keeps every frame.
    pub folder: &'a mut RunFolder,
    /// Distance from the target within which it counts as reached, metres.
    pub radius: f64,
    /// Set from outside to end the run.
    pub interrupted: &'a AtomicBool,
    /// Hears of every frame.
    pub progress: &'a mut dyn FnMut(&Row),
    /// Follows the motors, where a simulated rig does; an error of it ends the run.
    pub follow: Option<Follow<'a>>,
}

/// How far things came, over all targets.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// When the run began, seconds on the source's clock; set by the first target.
    pub begin: Option<f64>,
    /// Pictures so far.
    pub frames: u64,
    /// Pictures in which the ball was found and located.
    pub located: u64,
    /// Pictures that were lost or could not be searched.
    pub lost: u64,
    /// |e| of the filtered position to the present target, as the board last reported it, metres.
    pub error: Option<f64>,
    /// When the last picture was taken, seconds since the run's start.
    pub time: f64,
}

/// How a target ended, where nothing broke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The board holds the ball there.
    Reached,
    /// It took too long.
    OutOfPatience,
    /// The board has stopped by itself.
    Fault(Fault),
    /// The person at the keyboard ended it.
    Interrupted,
    /// The source has no more pictures.
    EndOfPictures,
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reached => f.write_str("reached"),
            Self::OutOfPatience => f.write_str("not reached in time"),
            Self::Fault(fault) => write!(f, "the board has stopped by itself: {fault}"),
            Self::Interrupted => f.write_str("interrupted"),
            Self::EndOfPictures => f.write_str("no more pictures"),
        }
    }
}

/// What broke a run.
#[derive(Debug, Error)]
pub enum DriveError {
    /// The link to the board.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The camera.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The detector, on one picture after the other.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// The run's folder.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// So many lost pictures in a row mean that the camera is gone.
const LOST_IN_A_ROW: u32 = 30;

/// A target is believed to be reached where the ball as the host sees it is within so many radii of
/// it: noise of a single picture has room, another target has not.
const PLAUSIBLE_RADII: f64 = 2.0;

/// Drives the ball to `target` (metres, rig frame) until it is there or `timeout` (seconds of the
/// source's clock) is over. `tally` goes on from what it was, also where an error ends this.
///
/// # Errors
/// Where the link, the camera or the folder fails. The board then stops by itself, since it hears
/// nothing more.
pub fn drive<S: CameraSource, T: Transport>(
    rig: &mut Rig<'_, S, T>,
    target: Point,
    timeout: f64,
    tally: &mut Tally,
) -> Result<Ending, DriveError> {
    rig.link.set_rates(target)?;
    tally.error = None;
    let begin = rig.source.now();
    let start = *tally.begin.get_or_insert(begin);
    let mut lost_in_a_row = 0;
    loop {
        if rig.interrupted.load(Ordering::Relaxed) {
            return Ok(Ending::Interrupted);
        }
        let seen = match look(rig) {
            Ok(Some(seen)) => Some(seen),
            Ok(None) => return Ok(Ending::EndOfPictures),
            Err(DriveError::Source(error)) if error.is_over() => return Err(error.into()),
            Err(error) => {
                tally.lost += 1;
                lost_in_a_row += 1;
                if lost_in_a_row >= LOST_IN_A_ROW {
                    return Err(error);
                }
                None
            }
        };
        report(rig, seen.as_ref())?;
        if let Some(seen) = &seen {
            lost_in_a_row = 0;
            note(rig, seen, target, seen.time - start, tally)?;
        }
        // A fault that has come after the telemetry of a held target counts.
        if let Some(fault) = rig.link.fault() {
            return Ok(Ending::Fault(fault));
        }
        if seen.is_some_and(|seen| is_reached(rig, &seen, target)) {
            return Ok(Ending::Reached);
        }
        if rig.source.now() - begin > timeout {
            return Ok(Ending::OutOfPatience);
        }
    }
}

/// Reports to the board what was seen, or that the picture was lost, and takes in what it says.
fn report<S: CameraSource, T: Transport>(
    rig: &mut Rig<'_, S, T>,
    seen: Option<&Seen>,
) -> Result<(), DriveError> {
    let age = seen.map_or(0.0, |seen| rig.source.now() - seen.time);
    // The board refuses an age that is beyond all bounds, and none is below 0.
    let age = Duration::try_from_secs_f64(age.max(0.0)).unwrap_or(Duration::MAX);
    let (ball, covariance) = seen.map_or((None, None), |seen| (seen.ball(), seen.covariance()));
    rig.link.position(ball, covariance, age)?;
    rig.link.poll()?;
    if let (Some(telemetry), Some(follow)) = (rig.link.telemetry(), &mut rig.follow) {
        follow(telemetry.motors.map(Steps16::to_si))?;
    }
    Ok(())
}

/// Counts the picture, taken at `time` (seconds since the run's start), and records its row.
fn note<S, T: Transport>(
    rig: &mut Rig<'_, S, T>,
    seen: &Seen,
    target: Point,
    time: f64,
    tally: &mut Tally,
) -> Result<(), DriveError> {
    tally.time = time;
    tally.located += u64::from(seen.ball().is_some());
    if let Some(telemetry) = rig.link.target_telemetry()
        && matches!(telemetry.state, State::Seeking | State::Holding)
        && tally.located > 0
    {
        tally.error = Some(telemetry.filtered_error.to_si());
    }
    let row = row(tally, seen, target, rig.link.telemetry(), rig.link.target_telemetry());
    tally.frames += 1;
    rig.folder.record(&row)?;
    (rig.progress)(&row);
    Ok(())
}

/// Whether the target is reached: the board holds this target and no other, its error is within the
/// radius, and the ball is seen to be there.
fn is_reached<S, T: Transport>(rig: &Rig<'_, S, T>, seen: &Seen, target: Point) -> bool {
    let target = Point3::from(target.to_metres());
    let held = rig.link.target_telemetry().is_some_and(|telemetry| {
        telemetry.state == State::Holding && telemetry.filtered_error.to_si() <= rig.radius
    });
    let there =
        |position: Gaussian3| (position.mean - target).norm() <= PLAUSIBLE_RADII * rig.radius;
    held && seen.position().is_some_and(there)
}

/// What one picture shows.
struct Seen {
    time: f64,
    ball: Option<BallObservation>,
}

impl Seen {
    /// Returns the ball's position and covariance; `None` if they are unknown.
    fn position(&self) -> Option<Gaussian3> {
        self.ball.and_then(|ball| ball.position)
    }

    /// Returns the ball's position for the board; `None` if it is unknown.
    fn ball(&self) -> Option<Point> {
        self.position().and_then(|position| Point::from_metres(position.mean.into()))
    }

    fn covariance(&self) -> Option<Covariance> {
        let position = self.position()?;
        Covariance::from_metres2(position.covariance.transpose().into())
    }
}

/// Takes the next picture and looks for the ball in it; `None` where there are no more.
fn look<S: CameraSource, T>(rig: &mut Rig<'_, S, T>) -> Result<Option<Seen>, DriveError> {
    let Some(frame) = rig.source.next_frame()? else { return Ok(None) };
    let ball = rig.detector.detect(&frame)?;
    Ok(Some(Seen { time: frame.time(), ball }))
}

/// The frame's row: what was seen, and the board as it was last heard of; its state only where that
/// is about the present target.
fn row(
    tally: &Tally,
    seen: &Seen,
    target: Point,
    telemetry: Option<&Telemetry>,
    about_target: Option<&Telemetry>,
) -> Row {
    let target = Point3::from(target.to_metres());
    let position = seen.position().map(|p| p.mean);
    Row {
        frame: tally.frames,
        t_s: tally.time,
        detection: seen.ball.map(Into::into),
        position,
        target: Some(target),
        error_m: position.map(|p| (p - target).norm()),
        board: about_target.map(|t| t.state.to_string()).unwrap_or_default(),
        motors_steps: telemetry.map(|t| t.motors.map(Steps16::to_si)),
        rates_steps_s: telemetry.map(|t| t.rates.map(Rate::to_si)),
    }
}
