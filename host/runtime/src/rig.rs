//! Rig file: the configuration of a rig in SI units, from which that of the board follows.

mod board;
mod cables;
pub mod check;
mod document;
mod guards;
mod law;
mod motion;
mod motion_error;
mod motion_limits;
mod motors;
mod picture;
pub mod quantity;
mod refused_wiring;
mod simulation;
mod size;
#[cfg(test)]
mod tests;

use std::path::Path;

use plumb_cameras::camera_file::is_camera_file;
use plumb_cameras::settings::CameraSettings;
use plumb_config::bounded_read::read_text;
use plumb_config::mistake::{Kind, Mistake};
use plumb_config::quantity::{Coordinate, NumberError};
use plumb_config::toml_file::{MAX_BYTES, TomlFileError, parse_toml, place};
use plumb_frame::camera::Camera;
use plumb_frame::image::ImageSize;
use plumb_protocol::config::{Config, Workspace};
use plumb_protocol::dimension::LEAST_MOTORS;
use plumb_protocol::prior::Prior;
use plumb_protocol::units::Point;
use plumb_protocol::wiring;
use serde::Deserialize;

use self::document::Document;
use self::quantity::Corner;
use self::size::RoughSize;
use quantity::Conversion;

pub use self::board::{
    BoardName, BoardPort, BoardSettings, EnableName, EnableSetting, InvertedSettings, PinSettings,
};
pub use self::cables::{CableSettings, Stiffness};
pub use self::guards::{DeadlineSettings, FollowingRule, GrowthRule, ProgressRule, ReachedRule};
pub use self::law::{Estimating, LawSettings, NOMINAL_STEP_M};
pub use self::motion::MotionRules;
pub use self::motion_error::{
    MistakenUnit, MotionError, Outside, Side, TargetAtBorder, WrongTarget,
};
pub use self::motors::Motors;
pub use self::simulation::Simulation;
pub use law::{LawName, UnknownLaw};
pub use motion_limits::{JogSettings, PathSettings};
pub use motors::{Driver, ModeName, TimingSettings, UartSettings};
pub use picture::{
    NOMINAL_JACOBIAN_M, PictureError, PictureFrame, PlaneSettings, Region, RigPicture, flat,
};
pub use quantity::{CABLE_PER_TURN_RANGE_M, FULL_STEPS_PER_REVOLUTION, OutOfRange};
pub use simulation::{MotorPoints, SimulatedMotor, Wiring, WiringError};
pub use size::{Box3, Size};

/// Reference page of the rig file: every key with its unit, range, default and meaning.
pub const REFERENCE: &str = include_str!("../../../docs/use/rig-file.md");

/// Microsteps that the straps of a TMC2209 can set, of those that the board drives (data sheet,
/// 2.1: pins MS1 and MS2).
pub const TMC2209_STRAPS: [u8; 2] = [8, 16];

const PAPER: &str = include_str!("../../rigs/paper.toml");

/// A rig file. Lengths in metres, times in seconds, motor positions in full steps.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// Targets of the ball in their order, metres in the rig frame.
    #[serde(default)]
    pub targets: Vec<[Coordinate; 3]>,
    /// The board and its pins.
    pub board: BoardSettings,
    /// The control law; `taut` where none is named.
    #[serde(default)]
    pub law: LawSettings,
    /// The cables.
    #[serde(default)]
    pub cables: CableSettings,
    /// The motors' limits.
    pub motors: Motors,
    /// Box that the ball and the targets must not leave. Beside `plane`, the widest one until the
    /// jogs have measured the picture.
    #[serde(default)]
    pub workspace: Box3,
    /// Rule by which a target counts as reached.
    #[serde(default)]
    pub reached: ReachedRule,
    /// Deadlines after which the board stops by itself.
    #[serde(default)]
    pub deadlines: DeadlineSettings,
    /// Rule by which a growing error stops the board.
    #[serde(default)]
    pub growth: GrowthRule,
    /// Rule by which motors that turn without the ball stop the board.
    #[serde(default)]
    pub following: FollowingRule,
    /// Rule by which a ball that gets no nearer to its target stops the board.
    #[serde(default)]
    pub progress: ProgressRule,
    /// Limits of jogs.
    #[serde(default)]
    pub jog: JogSettings,
    /// Limits of a reference that moves.
    #[serde(default)]
    pub path: PathSettings,
    /// Choice of the camera.
    pub camera: CameraSettings,
    /// Rough size of the rig.
    pub size: Option<Size>,
    /// The simulated rig; absent for a real one.
    pub simulation: Option<Simulation>,
    /// Places in the picture of a rig that two jogs measure.
    pub plane: Option<PlaneSettings>,
    /// The picture, once the jogs have measured it.
    #[serde(skip)]
    pub picture: Option<RigPicture>,
}

impl Rig {
    /// Reads a rig file. The path of the camera file becomes relative to the working directory.
    ///
    /// # Errors
    /// Where it cannot be read or is not a rig file.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        Self::parse(path, &read_text(path, MAX_BYTES)?)
    }

    /// Parses the text of the rig file at `path`, as [`read`](Self::read). The file is not read;
    /// errors name it.
    ///
    /// # Errors
    /// Where it is not the text of a rig file.
    pub fn parse(path: &Path, text: &str) -> Result<Self, TomlFileError> {
        let mut rig: Self = parse_toml(path, text).map_err(|error| match is_camera_file(text) {
            true => TomlFileError::OtherKind {
                path: path.to_owned(),
                found: "a camera file",
                wanted: "the rig file",
            },
            false => with_allowed(error, text),
        })?;
        rig.widen();
        if let Some(mistake) = plane_mistakes(text, &rig).into_iter().next() {
            let error = TomlFileError::Content {
                path: path.to_owned(),
                mistake: Box::new(mistake),
                allowed: String::new(),
            };
            return Err(with_allowed(error, text));
        }
        if let Some(folder) = path.parent() {
            rig.camera.relative_to(folder);
        }
        Ok(rig)
    }

    /// Gives a rig whose picture is not measured yet the widest workspace.
    fn widen(&mut self) {
        if self.plane.is_some() {
            self.workspace = Box3::WIDEST_PLANE;
        }
    }

    /// Returns the paper's rig, as in `rigs/paper.toml`.
    ///
    /// # Errors
    /// None in a released program: the file is part of it.
    pub fn paper() -> Result<Self, TomlFileError> {
        parse_toml(Path::new("rigs/paper.toml"), PAPER)
    }

    /// Replaces the targets, metres in the rig frame.
    ///
    /// # Errors
    /// Where a coordinate is out of its range.
    pub fn set_targets(&mut self, targets: &[[f64; 3]]) -> Result<(), NumberError> {
        let checked = |[x, y, z]: [f64; 3]| Ok([x.try_into()?, y.try_into()?, z.try_into()?]);
        self.targets = targets.iter().copied().map(checked).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// Returns the targets, metres in the rig frame.
    pub fn target_places(&self) -> impl Iterator<Item = [f64; 3]> {
        self.targets.iter().map(|target| target.map(Coordinate::get))
    }

    /// Returns the rig in `frame`: its targets (without any, the place of the ball), its workspace
    /// and the radius of "reached" are then in metres of the frame, and the law begins with the
    /// Jacobian. `camera` takes pictures of this `size`, later than their time stamps by
    /// `latency_s`; `ball` is the pixel where the ball hangs.
    ///
    /// # Errors
    /// Where the motors of the rig file leave no room in the picture.
    pub fn in_picture(
        &self,
        (frame, latency_s): (PictureFrame, f64),
        seen: (&Camera, ImageSize),
        ball: [f64; 2],
    ) -> Result<Self, PictureError> {
        let plane = self.plane.clone().unwrap_or_default();
        let picture = RigPicture::new(frame, &plane, seen, ball)?;
        let mut rig = self.clone();
        // A pixel beyond the range of coordinates is beyond the picture too.
        rig.set_targets(&picture.targets(&plane)).map_err(|_| PictureError::NoRoom)?;
        rig.workspace = picture.workspace();
        rig.reached.radius = picture.reached();
        rig.law.set_delay(latency_s);
        rig.picture = Some(picture);
        Ok(rig)
    }

    /// Returns the rules for a motion of the ball. Triangle and rates of the motors are checked
    /// where the rig file has the table `[size]` or `[simulation]`.
    pub fn motion_rules(&self) -> MotionRules {
        MotionRules {
            workspace: self.workspace,
            size: self.rough_size(),
            max_rate: self.motors.max_rate.get(),
            picture: self.picture.clone(),
        }
    }

    /// Returns the rough size by the table `[size]`, or else that of the simulated rig; `None` for
    /// a rig in a picture, whose frame is not that of a tape measure.
    fn rough_size(&self) -> Option<RoughSize> {
        if self.plane.is_some() {
            return None;
        }
        RoughSize::of(self.size.as_ref(), self.simulation.as_ref())
    }

    /// Returns the motor points, by the table `[simulation]` of a simulated rig, or else by
    /// `[size]`; `None` where the rig file has neither, or the rig is one in a picture.
    pub fn motor_points(&self) -> Option<MotorPoints> {
        if self.plane.is_some() {
            return None;
        }
        let exact = self.simulation.as_ref().map(Simulation::motors);
        let exact = exact.map(|places| MotorPoints { places, is_approximate: false });
        let rough = || {
            let places = self.size.as_ref().map(Size::motors)?;
            Some(MotorPoints { places, is_approximate: true })
        };
        exact.or_else(rough)
    }

    /// Returns the targets that the rig does not allow.
    pub fn wrong_targets(&self) -> Vec<WrongTarget> {
        self.motion_rules().wrong_targets(self.target_places())
    }

    /// Returns a speed above which the cables cannot move the ball, m/s.
    pub fn max_ball_speed(&self) -> f64 {
        /// Without the size: the fastest path that a board accepts, m/s.
        const UNKNOWN: f64 = 2.0;
        /// The ball may move faster than the cables where these are flat.
        const OF_CABLE: f64 = 4.0;
        let speed = |size: &Size| size.cable_per_step.get() * self.motors.max_rate.get();
        self.size.as_ref().map_or(UNKNOWN, |size| OF_CABLE * speed(size))
    }

    /// Returns the first of `targets` (metres) that is nearer to the border of the workspace than
    /// the radius of "reached".
    pub fn target_at_border(
        &self,
        targets: impl IntoIterator<Item = [f64; 3]>,
    ) -> Option<TargetAtBorder> {
        let (rules, enough_m) = (self.motion_rules(), self.reached.radius.get());
        let mut rooms = (1..).zip(targets).map(|(number, target)| (number, rules.room(target)));
        // What rounding leaves of a radius is enough.
        let (number, room_m) = rooms.find(|(_, room)| *room < enough_m - 1e-6)?;
        Some(TargetAtBorder { number, room_m, enough_m })
    }

    /// Returns the wiring of the board.
    ///
    /// # Errors
    /// The first value that is beyond the range of the wire, or that the board refuses.
    pub fn wiring(&self) -> Result<wiring::Wiring, OutOfRange> {
        let wiring = self.unchecked_wiring()?;
        let refused = |error| refused_wiring::refusal(&self.motors, &wiring, error);
        wiring.check(None).map_err(refused).map(|()| wiring)
    }

    /// Returns the wiring of the board, also one that the board refuses.
    ///
    /// # Errors
    /// The first value that is beyond the range of the wire.
    pub(crate) fn unchecked_wiring(&self) -> Result<wiring::Wiring, OutOfRange> {
        Conversion::first_error(|conversion| self.convert_wiring(conversion))
    }

    /// Returns the configuration of the board, in its own units.
    ///
    /// # Errors
    /// The first value that is beyond the range of the wire. The board checks its own, narrower
    /// ranges.
    pub fn config(&self) -> Result<Config, OutOfRange> {
        Conversion::first_error(|conversion| self.convert(conversion))
    }

    /// Returns what the law begins with: [`Size::prior`] for the law taut, the Jacobian of the
    /// picture for the law adaptive.
    #[must_use]
    pub fn prior(&self) -> Option<Prior> {
        match self.law.name() {
            LawName::Taut => self.size.as_ref()?.prior().map(Prior::Rig),
            LawName::Adaptive => self.picture.as_ref().map(|picture| picture.frame.prior()),
            LawName::Interval | LawName::Sign => None,
        }
    }

    /// Returns the targets in the board's units.
    ///
    /// # Errors
    /// The first target that is beyond the range of the wire.
    pub fn targets(&self) -> Result<Vec<Point>, OutOfRange> {
        Conversion::first_error(|conversion| {
            self.target_places().map(|target| conversion.point("targets", target)).collect()
        })
    }

    fn convert_wiring(&self, conversion: &mut Conversion) -> wiring::Wiring {
        wiring::Wiring {
            board: self.board.kind.kind(),
            pins: self.board.pins(self.motors.driver.enable(), self.motors.count(), conversion),
            drivers: self.motors.convert_driver(&self.board, conversion),
        }
    }

    fn convert(&self, conversion: &mut Conversion) -> Config {
        Config {
            law: self.law.convert(self.motors.count(), conversion),
            motors: self.motors.convert(conversion),
            microsteps: self.motors.microsteps,
            workspace: Workspace {
                min: conversion.point("workspace.min", self.workspace.min.map(Corner::get)),
                max: conversion.point("workspace.max", self.workspace.max.map(Corner::get)),
            },
            reached: self.reached.convert(conversion),
            deadlines: self.deadlines.convert(conversion),
            growth: self.growth.convert(conversion),
            following: self.following.convert(conversion),
            progress: self.progress.convert(conversion),
            jog: self.jog.convert(conversion),
            path: self.path.convert(conversion),
            mean: self.law.convert_mean(self.cables, conversion),
        }
    }
}

/// Returns the mistakes of a rig file with this text about its plane: what is missing without it,
/// and what does not go with it.
fn plane_mistakes(text: &str, rig: &Rig) -> Vec<Mistake> {
    let mistake = |key: &str, kind, message: &str| {
        let at = place(text, key);
        let line = at.as_ref().map_or(text.lines().count(), |at| at.line);
        let value = String::new();
        Mistake { line, key: key.to_owned(), value, kind, message: message.to_owned() }
    };
    let is_there = |key: &&str| place(text, key).is_some();
    let frame = ["targets", "workspace"];
    if rig.plane.is_none() {
        let missing = frame.into_iter().filter(|key| !is_there(key));
        return missing.map(|key| mistake(key, Kind::Missing, "")).collect();
    }
    let beside = "goes with no `[plane]`, where both are places in the picture";
    let both = frame.into_iter().filter(is_there);
    let mut mistakes: Vec<_> = both.map(|key| mistake(key, Kind::Wrong, beside)).collect();
    if rig.motors.count() != LEAST_MOTORS {
        mistakes.push(mistake("plane", Kind::Wrong, "needs `motors.count = 2`"));
    }
    mistakes
}

/// Returns the error of a rig file with this text, with what is allowed.
fn with_allowed(error: TomlFileError, text: &str) -> TomlFileError {
    match error {
        TomlFileError::Content { path, mistake, .. } => {
            let allowed = Document::new(&path, text, REFERENCE).mistake(&mistake).allowed;
            TomlFileError::Content { path, mistake, allowed }
        }
        other => other,
    }
}
