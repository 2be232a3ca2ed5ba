//! A whole run: greets and configures the board, drives the ball through the targets, and leaves the run's folder.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use nalgebra::Point3;
use serde::Serialize;
use thiserror::Error;

use crate::camera::Camera;
use crate::detect::Detector;
use crate::drive::{DriveError, Ending, Tally, drive};
use crate::link::{Link, LinkError, Transport};
use crate::rig::{OutOfRange, Rig};
use crate::run::{Row, RunError, RunFolder, Scene};
use crate::source::Live;

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
    /// The camera's geometry.
    pub camera: &'a Camera,
    /// Finds the ball.
    pub detector: &'a mut dyn Detector,
    /// Where the folder goes.
    pub place: Place,
    /// Seconds that each target may take.
    pub patience: f64,
    /// Set from outside to end the run.
    pub interrupted: &'a AtomicBool,
    /// Hears of every frame.
    pub progress: &'a mut dyn FnMut(&Row),
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
    /// Pictures in which the ball was found and located.
    pub located: u64,
    /// Pictures that were lost or could not be searched.
    pub lost: u64,
    /// Positions that the board did not take.
    pub refused_positions: u32,
    /// Why the run ended.
    pub ending: String,
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
    /// No folder for the run.
    #[error(transparent)]
    Folder(#[from] RunError),
    /// The board did not take the greeting or the configuration.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It broke under way; what was recorded is in the folder.
    #[error("{error} (recorded so far: {}, {} frames)", .folder.display(), .summary.frames)]
    Broken {
        /// What broke.
        error: Box<DriveError>,
        /// The run's folder, complete up to that moment.
        folder: PathBuf,
        /// What the run had come to.
        summary: Box<Summary>,
    },
}

impl Session<'_> {
    /// Runs, with the board at the other end of `transport` and pictures from `source`. Returns what it came to and
    /// where that is kept; the motors are ramped down.
    ///
    /// # Errors
    /// Where it could not begin, or broke. Whatever happens after the first picture, the folder is complete.
    pub fn run<S: Live, T: Transport>(
        mut self,
        source: &mut S,
        transport: T,
    ) -> Result<(Summary, PathBuf), SessionError> {
        let (config, targets) = (self.rig.config()?, self.rig.targets()?);
        if let Some(target) = targets.iter().find(|t| !config.workspace.contains(**t)) {
            return Err(SessionError::TargetOutside(target.to_metres()));
        }
        let mut link = Link::greet(transport)?;
        link.configure(config)?;
        let mut folder = self.folder()?;
        let path = folder.path().to_owned();

        let mut tally = Tally::default();
        let mut reached = 0;
        let mut result = Ok(Ending::Reached);
        for target in targets {
            let mut rig = crate::drive::Rig {
                source: &mut *source,
                detector: &mut *self.detector,
                camera: self.camera,
                link: &mut link,
                folder: &mut folder,
                interrupted: self.interrupted,
                progress: &mut *self.progress,
            };
            result = drive(&mut rig, target, self.patience, &mut tally);
            match result {
                Ok(Ending::Reached) => reached += 1,
                _ => break,
            }
        }
        // The run is over either way; a board that cannot be told stops by its own deadline.
        let stopped = link.stop().map_err(DriveError::from);
        let result = result.and_then(|ending| stopped.map(|()| ending));
        let summary = self.summary(&tally, reached, &result, link.refused_positions());
        folder.finish(&summary)?;
        match result {
            Ok(_) => Ok((summary, path)),
            Err(error) => {
                Err(SessionError::Broken { error: error.into(), folder: path, summary: summary.into() })
            }
        }
    }

    fn folder(&mut self) -> Result<RunFolder, RunError> {
        let geometry = self.rig.simulation.as_ref().and_then(|s| s.geometry().ok());
        let scene = Scene {
            title: self.rig.law.title(),
            threshold_m: self.rig.reached.radius.get(),
            motors: geometry.map(|g| g.motors().map(Point3::from)),
        };
        match &self.place {
            Place::Folder(path) => RunFolder::create(path, scene),
            Place::Numbered(prefix) => RunFolder::create_numbered("runs", prefix, scene),
        }
    }

    fn summary(
        &self,
        tally: &Tally,
        targets_reached: usize,
        result: &Result<Ending, DriveError>,
        refused_positions: u32,
    ) -> Summary {
        Summary {
            reached: matches!(result, Ok(Ending::Reached)),
            law: self.rig.law.name(),
            detector: self.detector.name(),
            frames: tally.frames,
            time_s: round(tally.time, 1e6),
            error_mm: tally.error.map(|e| round(e * 1e3, 1e3)),
            targets_reached,
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

/// `value` to the nearest 1/`per`: what is printed, without digits that mean nothing.
fn round(value: f64, per: f64) -> f64 {
    (value * per).round() / per
}
