//! What a board is configured with: the law and its parameters, the motors, where the ball may be,
//! and deadlines.
//!
//! These are the chip's parameters, already in its units. People write SI (TOML, on the host),
//! which is turned into this once.

mod example;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, Nanoseconds, Point, Rate, SignGain,
    Steps16,
};

/// Everything a board must know before it moves.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// The control law.
    pub law: Law,
    /// The motors A, B and C.
    pub motors: [Motor; 3],
    /// Microsteps in a full step that the drivers are set to: 1, 2, 4, 8 or 16.
    pub microsteps: u8,
    /// Where the ball and its target may be.
    pub workspace: Workspace,
    /// When the target counts as reached.
    pub reached: Reached,
    /// After how long the board stops by itself.
    pub deadlines: Deadlines,
    /// When a growing error means that a motor is swapped or reversed.
    pub growth: Growth,
    /// What turns the motors.
    pub drivers: Drivers,
    /// Span of the running mean over the step plan, at most 400 ms; 0 is none.
    pub mean: Milliseconds,
}

/// A control law and its parameters. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// The paper's law for an interval family of Jacobians.
    Interval(Interval),
    /// A constant matrix: the signs of J and nothing else.
    Sign(Sign),
    /// J is estimated while driving, and used where descent is certain.
    Adaptive(Estimated),
    /// The rig's geometry is estimated while driving, and the cables are kept taut.
    Taut(Estimated),
}

/// The gain of the law of signs, for a rig of pattern [`SIGNS`].
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sign {
    /// g/(4s).
    pub gain: SignGain,
}

/// What a law that estimates is told, for a rig of about the pattern [`SIGNS`].
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Estimated {
    /// Delay beyond each position's age: what nobody has told the host. A millisecond too much
    /// costs less than one too little.
    pub delay: Milliseconds,
}

/// The interval family and the gain of the paper's law, eqs. (7), (8) and (13).
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Σ: the sign of each entry of J, row by row (x, y, z) by column (cable A, B, C): -1, 0 or +1.
    pub signs: [[i8; 3]; 3],
    /// α_ik: the least |J_ik|; ignored where the sign is 0.
    pub alpha: [[Bound; 3]; 3],
    /// β_ik: the largest |J_ik|, not below α_ik; ignored where the sign is 0.
    pub beta: [[Bound; 3]; 3],
    /// From v to motor rates.
    pub gain: Gain,
}

/// The sign pattern (12) of a rig whose motors hang at one height.
pub const SIGNS: [[i8; 3]; 3] = [[-1, -1, 1], [-1, 1, 0], [-1, -1, -1]];

impl Interval {
    /// The family (12), (13) with one pair of bounds for every entry.
    pub const fn uniform(alpha: Bound, beta: Bound, gain: Gain) -> Self {
        Self { signs: SIGNS, alpha: [[alpha; 3]; 3], beta: [[beta; 3]; 3], gain }
    }
}

/// Limits of one motor.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Motor {
    /// Highest rate in either direction.
    pub max_rate: Rate,
    /// Highest acceleration and deceleration.
    pub max_acceleration: Acceleration,
    /// Lowest position, counted from where the motor was when the board started; at most 0.
    pub travel_min: Steps16,
    /// Highest position, likewise; at least 0.
    pub travel_max: Steps16,
    /// Whether the motor pays out when its direction line says the opposite.
    pub reversed: bool,
}

/// A box in the rig frame.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Workspace {
    /// Its corner of smallest coordinates.
    pub min: Point,
    /// Its corner of largest coordinates.
    pub max: Point,
}

impl Workspace {
    /// Whether `p` is inside or on the border.
    pub fn contains(&self, p: Point) -> bool {
        (0..3).all(|i| self.min.0[i] <= p.0[i] && p.0[i] <= self.max.0[i])
    }
}

/// When a target counts as reached: the filtered |e| within 0.8 of `radius` for `frames` positions
/// in a row.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reached {
    /// Distance from the target that the ball is to be within.
    pub radius: Micrometres,
    /// Positions in a row.
    pub frames: u8,
}

/// After how long the board stops by itself, and what it takes for fresh.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// Without a valid frame from the host while moving or holding.
    pub host: Milliseconds,
    /// Without a fresh position while seeking or holding.
    pub position: Milliseconds,
    /// A position older than this at its arrival is refused; below `position`.
    pub max_age: Milliseconds,
}

/// A target is given up when |e| has stayed beyond its smallest value so far by `margin` for
/// `time`.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Growth {
    /// How much above the smallest |e| since the target was set.
    pub margin: Micrometres,
    /// For how long.
    pub time: Milliseconds,
}

/// What turns the motors. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drivers {
    /// A driver for each motor with inputs STEP, DIR and ENABLE (on where low).
    StepDir(StepDir),
    /// Two H-bridges for each motor on four pins of the board, enabled where high (TB6612 and the
    /// like); 1 microstep is full steps, 2 are half steps, more are by pulse-width modulation.
    Coils(Coils),
    /// Two Adafruit Motor HATs (PCA9685 at 0x60: motors A and B, at 0x61: motor C).
    MotorHats(Coils),
}

/// The times that a driver's inputs need, from its data sheet.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepDir {
    /// Least time STEP is high; DIR is held for as long.
    pub high: Nanoseconds,
    /// Least time STEP is low.
    pub low: Nanoseconds,
    /// Least time from a change of DIR to STEP going high.
    pub setup: Nanoseconds,
}

impl StepDir {
    /// Allegro A4988 (data sheet rev. 5, figure 1).
    pub const A4988: Self = Self::new(1000, 1000, 200);
    /// Texas Instruments DRV8825 (SLVSA73F, section 6.6).
    pub const DRV8825: Self = Self::new(1900, 1900, 650);
    /// Trinamic TMC2209 (data sheet rev. 1.09, section 13.1).
    pub const TMC2209: Self = Self::new(100, 100, 20);

    const fn new(high: u16, low: u16, setup: u16) -> Self {
        Self { high: Nanoseconds(high), low: Nanoseconds(low), setup: Nanoseconds(setup) }
    }
}

/// How coils are driven.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coils {
    /// The share of the supply's voltage that a coil gets at most, percent: 1 to 100.
    pub duty_percent: u8,
}
