//! Rig file: the configuration of a rig in SI units, from which that of the board follows.

mod driver;
mod jog;
mod law;
mod law_name;

use std::path::Path;

use nalgebra::Point3;
use plumb_cameras::settings::CameraSettings;
use plumb_cameras::toml_file::{
    Finite, NumberError, Positive, TomlFileError, parse_toml, read_toml,
};
use plumb_protocol::config::{Config, Deadlines, Growth, Motor, Reached, Workspace};
use plumb_protocol::units::{Acceleration, Micrometres, Milliseconds, Point, Rate, Steps16};
use serde::Deserialize;
use thiserror::Error;

pub use self::driver::Driver;
pub use self::jog::JogSettings;
pub use self::law::{Estimating, LawSettings, NOMINAL_STEP_M, Seconds};
pub use self::law_name::{LawName, UnknownLaw};

const PAPER: &str = include_str!("../../rigs/paper.toml");

/// A rig file. Lengths in metres, times in seconds, motor positions in full steps.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// Targets of the ball in their order, metres in the rig frame.
    pub targets: Vec<[Finite; 3]>,
    /// Serial port of the board.
    pub board: BoardPort,
    /// The control law; `taut` where none is named.
    #[serde(default)]
    pub law: LawSettings,
    /// The motors' limits.
    pub motors: Motors,
    /// Box that the ball and the targets must not leave.
    pub workspace: Box3,
    /// Rule by which a target counts as reached.
    pub reached: ReachedRule,
    /// Deadlines after which the board stops by itself.
    pub deadlines: DeadlineSettings,
    /// Rule by which a growing error stops the board.
    pub growth: GrowthRule,
    /// Limits of jogs.
    #[serde(default)]
    pub jog: JogSettings,
    /// Choice of the camera.
    pub camera: CameraSettings,
    /// The simulated rig; absent for a real one.
    pub simulation: Option<Simulation>,
}

/// Serial port of the board.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardPort {
    /// Its path.
    pub port: String,
    /// Its rate, bit/s; without effect on USB-CDC.
    #[serde(default = "default_baud")]
    pub baud: u32,
}

fn default_baud() -> u32 {
    115_200
}

/// Limits of the motors, and their drivers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motors {
    /// Highest rate, full steps/s.
    pub max_rate: Positive,
    /// Highest acceleration, full steps/s².
    pub max_acceleration: Positive,
    /// Microsteps in a full step: 1, 2, 4, 8 or 16.
    pub microsteps: u8,
    /// Lowest and highest position, full steps from where the board started.
    pub travel: [Finite; 2],
    /// Whether A, B, C turn the wrong way round.
    #[serde(default)]
    pub reversed: [bool; 3],
    /// The drivers of the motors.
    #[serde(default)]
    pub driver: Driver,
}

/// Box in the rig frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Box3 {
    /// Corner of smallest coordinates, metres.
    pub min: [Finite; 3],
    /// Corner of largest coordinates, metres.
    pub max: [Finite; 3],
}

/// See [`plumb_protocol::config::Reached`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachedRule {
    /// Distance, metres.
    pub radius: Positive,
    /// Number of consecutive frames.
    pub frames: u8,
}

/// See [`plumb_protocol::config::Deadlines`]; seconds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeadlineSettings {
    /// Without a frame from the host.
    pub host: Positive,
    /// Without a fresh position.
    pub position: Positive,
    /// Greatest age of a frame that is used, seconds; below `position`.
    pub max_age: Positive,
}

/// See [`plumb_protocol::config::Growth`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrowthRule {
    /// Metres above the least |e|.
    pub margin: Positive,
    /// For so long, seconds.
    pub time: Positive,
}

/// A simulated rig.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Motor points A, B, C, metres in the rig frame.
    pub motors: [[Finite; 3]; 3],
    /// Pulley radii, metres.
    pub pulley_radii: [Finite; 3],
    /// First position of the ball, metres in the rig frame.
    pub start: [Finite; 3],
}

impl Simulation {
    /// Returns the motor points A, B, C, metres in the rig frame.
    pub fn motors(&self) -> [Point3<f64>; 3] {
        self.motors.map(|motor| Point3::from(motor.map(Finite::get)))
    }

    /// Returns the ball's first position, metres in the rig frame.
    pub fn start(&self) -> Point3<f64> {
        Point3::from(self.start.map(Finite::get))
    }
}

/// Value that the board cannot be sent.
#[derive(Debug, Error, PartialEq)]
#[error("`{key}` = {value} {why}")]
pub struct OutOfRange {
    /// The key in the rig file.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// Reason.
    pub why: &'static str,
}

/// Reason of a value that is beyond the range of the wire.
const NO_ROOM: &str = "is out of the board's range";

impl Rig {
    /// Reads a rig file. The path of the camera file becomes relative to the working directory.
    ///
    /// # Errors
    /// Where it cannot be read or is not a rig file.
    pub fn read(path: &Path) -> Result<Self, TomlFileError> {
        let mut rig: Self = read_toml(path)?;
        if let Some(folder) = path.parent() {
            rig.camera.relative_to(folder);
        }
        Ok(rig)
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
    /// Where a coordinate is not finite.
    pub fn set_targets(&mut self, targets: &[[f64; 3]]) -> Result<(), NumberError> {
        let finite = |[x, y, z]: [f64; 3]| Ok([x.try_into()?, y.try_into()?, z.try_into()?]);
        self.targets = targets.iter().copied().map(finite).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// Returns the configuration of the board, in its own units.
    ///
    /// # Errors
    /// The first value that is beyond the range of the wire. The board checks its own, narrower
    /// ranges.
    pub fn config(&self) -> Result<Config, OutOfRange> {
        Ok(Config {
            law: self.law.config()?,
            motors: [self.motors.config(0)?, self.motors.config(1)?, self.motors.config(2)?],
            microsteps: self.motors.microsteps,
            workspace: Workspace {
                min: point("workspace.min", self.workspace.min)?,
                max: point("workspace.max", self.workspace.max)?,
            },
            reached: Reached {
                radius: fit("reached.radius", self.reached.radius.get(), Micrometres::from_si)?,
                frames: self.reached.frames,
            },
            deadlines: self.deadlines.config()?,
            drivers: self.motors.driver.config()?,
            growth: Growth {
                margin: fit("growth.margin", self.growth.margin.get(), Micrometres::from_si)?,
                time: fit("growth.time", self.growth.time.get(), Milliseconds::from_si)?,
            },
            jog: self.jog.config()?,
            mean: self.law.mean().config("law.mean")?,
        })
    }

    /// Returns the targets in the board's units.
    ///
    /// # Errors
    /// The first target that is beyond the range of the wire.
    pub fn targets(&self) -> Result<Vec<Point>, OutOfRange> {
        self.targets.iter().map(|&target| point("targets", target)).collect()
    }
}

impl Motors {
    fn config(&self, motor: usize) -> Result<Motor, OutOfRange> {
        let [min, max] = self.travel.map(Finite::get);
        Ok(Motor {
            max_rate: fit("motors.max_rate", self.max_rate.get(), Rate::from_si)?,
            max_acceleration: fit(
                "motors.max_acceleration",
                self.max_acceleration.get(),
                Acceleration::from_si,
            )?,
            travel_min: fit("motors.travel", min, Steps16::from_si)?,
            travel_max: fit("motors.travel", max, Steps16::from_si)?,
            reversed: self.reversed[motor],
        })
    }
}

impl DeadlineSettings {
    fn config(&self) -> Result<Deadlines, OutOfRange> {
        let max_age = self.max_age.get();
        if max_age >= self.position.get() {
            let why = "is not below `deadlines.position`: the board would drive on \
                       positions that are older than that deadline";
            return Err(OutOfRange { key: "deadlines.max_age", value: max_age, why });
        }
        Ok(Deadlines {
            host: fit("deadlines.host", self.host.get(), Milliseconds::from_si)?,
            position: fit("deadlines.position", self.position.get(), Milliseconds::from_si)?,
            max_age: fit("deadlines.max_age", self.max_age.get(), Milliseconds::from_si)?,
        })
    }
}

/// Converts `value`. The error names its key.
fn fit<Q>(
    key: &'static str,
    value: f64,
    convert: impl FnOnce(f64) -> Option<Q>,
) -> Result<Q, OutOfRange> {
    convert(value).ok_or(OutOfRange { key, value, why: NO_ROOM })
}

fn point(key: &'static str, metres: [Finite; 3]) -> Result<Point, OutOfRange> {
    let metres = metres.map(Finite::get);
    Point::from_metres(metres).ok_or(OutOfRange {
        key,
        value: metres.into_iter().fold(0.0, |a, b| if b.abs() > f64::abs(a) { b } else { a }),
        why: NO_ROOM,
    })
}
