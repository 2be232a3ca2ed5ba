//! A whole run: greets and configures the board, drives the ball through the targets, and leaves
//! the run's folder.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use plumb_cameras::source::CameraSource;
use plumb_protocol::units::Point;
use plumb_vision::detect::BallDetector;
use serde::Serialize;
use thiserror::Error;

use crate::drive::{DriveError, Ending, Follow, Tally, drive};
use crate::link::{Link, LinkError, Transport};
use crate::rig::{OutOfRange, Rig, Simulation};
use crate::run::{Row, RunError, RunFolder, Scene};

/// Where a run leaves its folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// This folder, which must be new or empty.
    Folder(PathBuf),
    /// The next free number under `runs/`, with this prefix.
    Numbered(&'static str),
}

/// What a run is given besides the rig.
pub struct Session<'a> {
    /// The rig and its targets.
    pub rig: &'a Rig,
    /// Finds the ball.
    pub detector: &'a mut dyn BallDetector,
    /// Where the folder goes.
    pub place: Place,
    /// Seconds that each target may take.
    pub timeout: f64,
    /// Set from outside to end the run.
    pub interrupted: &'a AtomicBool,
    /// Hears of every frame.
    pub progress: &'a mut dyn FnMut(&Row),
    /// Follows the motors, where a simulated rig does; an error of it ends the run.
    pub follow: Option<Follow<'a>>,
}

/// What a run came to: `summary.json`, and the last line of `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Whether every target was reached.
    pub reached: bool,
    /// The control law.
    pub law: &'static str,
    /// The detector.
    pub detector: &'static str,
    /// Pictures until the end.
    pub frames: u64,
    /// Seconds until the end, on the pictures' clock.
    pub time_s: f64,
    /// The board's filtered |e| at the end, millimetres; absent where it never told.
    pub error_mm: Option<f64>,
    /// Targets reached.
    pub targets_reached: usize,
    /// The targets that were driven to, in order.
    pub legs: Vec<Leg>,
    /// Whether the board said at the end that its motors stand still.
    pub at_rest: bool,
    /// Pictures in which the ball was found and located.
    pub located: u64,
    /// Pictures that were lost or could not be searched.
    pub lost: u64,
    /// Positions that the board did not take.
    pub refused_positions: u32,
    /// Why the run ended.
    pub ending: String,
}

/// A target, and how the drive to it went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leg {
    /// Metres in the rig frame.
    pub target: [f64; 3],
    /// Pictures until its end.
    pub frames: u64,
    /// Whether it was reached.
    pub reached: bool,
    /// The board's filtered |e| at its end, millimetres; absent where the board told none, or the
    /// ball was never seen.
    pub error_mm: Option<f64>,
}

/// A run that has ended in order: what it came to, and where that is kept.
#[derive(Debug)]
pub struct Ended {
    /// What it came to.
    pub summary: Summary,
    /// The run's folder.
    pub folder: PathBuf,
    /// What could not be written into the folder.
    pub unwritten: Option<RunError>,
}

/// What kept a run from beginning or broke it.
#[derive(Debug, Error)]
pub enum SessionError {
    /// The rig file says what the board cannot be told.
    #[error("rig file: {0}")]
    Config(#[from] OutOfRange),
    /// The rig file, or what was typed, asks for the impossible.
    #[error("the target {0:?} m is outside the workspace of the rig file")]
    TargetOutside([f64; 3]),
    /// There is nothing to do.
    #[error("the rig file has no targets: list them as `targets = [[x, y, z], ...]`, metres")]
    NoTargets,
    /// No folder for the run.
    #[error(transparent)]
    Folder(#[from] RunError),
    /// The board did not take the greeting or the configuration.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It broke under way; what was recorded is in the folder.
    #[error("{error} (recorded so far: {}, {} frames)", .ended.folder.display(), .ended.summary.frames)]
    Broken {
        /// What broke.
        error: Box<DriveError>,
        /// What the run had come to.
        ended: Box<Ended>,
    },
}

impl Session<'_> {
    /// Runs, with the board at the other end of `transport` and pictures from `source`. The motors
    /// are ramped down at the end.
    ///
    /// # Errors
    /// Where it could not begin, or broke. Whatever happens after the first picture, the folder is
    /// complete, save for what cannot be written, which is told besides.
    pub fn run<S: CameraSource, T: Transport>(
        mut self,
        source: &mut S,
        transport: T,
    ) -> Result<Ended, SessionError> {
        let (config, targets) = (self.rig.config()?, self.rig.targets()?);
        if targets.is_empty() {
            return Err(SessionError::NoTargets);
        }
        if let Some(target) = targets.iter().find(|t| !config.workspace.contains(**t)) {
            return Err(SessionError::TargetOutside(target.to_metres()));
        }
        let mut link = Link::greet(transport)?;
        link.configure(config)?;
        let mut folder = self.folder()?;
        let path = folder.path().to_owned();

        let (mut tally, mut legs) = (Tally::default(), Vec::new());
        let result =
            self.drive_all(source, &mut link, &mut folder, &targets, &mut tally, &mut legs);
        let (result, at_rest) = come_to_rest(&mut link, result);
        let summary =
            self.summary(&tally, legs, targets.len(), &result, at_rest, link.refused_positions());
        let unwritten = folder.finish(&summary).err();
        let ended = Ended { summary, folder: path, unwritten };
        match result {
            Ok(_) => Ok(ended),
            Err(error) => Err(SessionError::Broken { error: error.into(), ended: ended.into() }),
        }
    }

    /// Drives to one target after the other until one is not reached.
    fn drive_all<S: CameraSource, T: Transport>(
        &mut self,
        source: &mut S,
        link: &mut Link<T>,
        folder: &mut RunFolder,
        targets: &[Point],
        tally: &mut Tally,
        legs: &mut Vec<Leg>,
    ) -> Result<Ending, DriveError> {
        let mut rig = crate::drive::Rig {
            source,
            detector: &mut *self.detector,
            link,
            folder,
            radius: self.rig.reached.radius.get(),
            interrupted: self.interrupted,
            progress: &mut *self.progress,
            follow: match &mut self.follow {
                Some(follow) => Some(&mut **follow),
                None => None,
            },
        };
        for &target in targets {
            let before = tally.frames;
            let result = drive(&mut rig, target, self.timeout, tally);
            let reached = matches!(result, Ok(Ending::Reached));
            legs.push(Leg {
                target: target.to_metres().map(|metres| round(metres, 1e6)),
                frames: tally.frames - before,
                reached,
                error_mm: tally.error.map(millimetres),
            });
            if !reached {
                return result;
            }
        }
        Ok(Ending::Reached)
    }

    fn folder(&mut self) -> Result<RunFolder, RunError> {
        let scene = Scene {
            title: self.rig.law.title(),
            threshold_m: self.rig.reached.radius.get(),
            motors: self.rig.simulation.as_ref().map(Simulation::motors),
        };
        match &self.place {
            Place::Folder(path) => RunFolder::create(path, scene),
            Place::Numbered(prefix) => RunFolder::create_numbered("runs", prefix, scene),
        }
    }

    fn summary(
        &self,
        tally: &Tally,
        legs: Vec<Leg>,
        targets: usize,
        result: &Result<Ending, DriveError>,
        at_rest: bool,
        refused_positions: u32,
    ) -> Summary {
        let targets_reached = legs.iter().filter(|leg| leg.reached).count();
        Summary {
            reached: targets_reached == targets,
            law: self.rig.law.name(),
            detector: self.detector.name(),
            frames: tally.frames,
            time_s: round(tally.time, 1e6),
            error_mm: tally.error.map(millimetres),
            targets_reached,
            legs,
            at_rest,
            located: tally.located,
            lost: tally.lost,
            refused_positions,
            ending: match result {
                Ok(ending) => ending.to_string(),
                Err(error) => error.to_string(),
            },
        }
    }
}

/// Ends a run at the board: ramps the motors down and waits until they stand. Returns how the run
/// ended, and whether the board said that they stand.
fn come_to_rest<T: Transport>(
    link: &mut Link<T>,
    result: Result<Ending, DriveError>,
) -> (Result<Ending, DriveError>, bool) {
    let is_broken = matches!(&result, Err(DriveError::Link(error)) if !matches!(error, LinkError::Refused { .. }));
    if is_broken {
        // The first cause counts, and a board without a host stops by itself.
        link.abandon();
        return (result, false);
    }
    match link.stop() {
        Ok(()) => (result, true),
        Err(error) => (result.and(Err(error.into())), false),
    }
}

/// `metres` in millimetres, to the nearest thousandth.
fn millimetres(metres: f64) -> f64 {
    round(metres * 1e3, 1e3)
}

/// `value` to the nearest 1/`per`: what is printed, without digits that mean nothing.
fn round(value: f64, per: f64) -> f64 {
    (value * per).round() / per
}
