//! Configuration of a board: the law and its parameters, motors, workspace and deadlines. Its pins
//! and drivers are its [wiring](crate::wiring).
//!
//! The values are in the chip's units. A rig file is in SI (TOML, on the host); the host converts
//! it once.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::dimension::{AXES, LEAST_MOTORS, MOTORS, MotorList, PerAxis, PerMotor};
use crate::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, PathAcceleration, PathJerk, Point, Rate,
    SignGain, Speed, Steps16,
};

/// Configuration of a board. A board needs one before it moves.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// The control law.
    pub law: Law,
    /// The motors: A, B and C, whose ball moves in space; or A and B, whose ball moves in the plane
    /// x = 0.
    pub motors: MotorList<Motor>,
    /// Microsteps per full step, as set at the drivers: 1, 2, 4, 8 or 16.
    pub microsteps: u8,
    /// Box that the ball and its target must not leave. For two motors it has no width along x.
    pub workspace: Workspace,
    /// Condition for a reached target.
    pub reached: Reached,
    /// Times after which the board stops by itself.
    pub deadlines: Deadlines,
    /// Limit of the error's growth; beyond it, a motor is probably swapped or reversed.
    pub growth: Growth,
    /// Limit of the motors' turn without the ball.
    pub following: Following,
    /// Limit of the time without progress.
    pub progress: Progress,
    /// Limits of jogs.
    pub jog: JogLimits,
    /// Limits of a reference that moves.
    pub path: PathLimits,
    /// Span of the running mean over the step plan, at most 400 ms; 0 turns it off.
    pub mean: Milliseconds,
}

/// A control law and its parameters. Grows at its end.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// The paper's law for an interval family of Jacobians.
    Interval(Interval),
    /// A constant matrix made of the signs of J.
    Sign(Sign),
    /// Estimates the Jacobian J during the run, and uses it where descent is certain.
    Adaptive(Estimated),
    /// Estimates the rig's geometry during the run, and keeps the cables taut.
    Taut(Estimated),
}

/// Parameter of the law `sign`, for a rig with the sign pattern [`SIGNS`].
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sign {
    /// Gain g/(4s): g in 1/s, s in metres of cable per step.
    pub gain: SignGain,
}

/// Parameter of the estimating laws, for a rig with approximately the pattern [`SIGNS`].
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Estimated {
    /// Delay in addition to each position's age: the part that the host cannot measure. An
    /// estimate that is 1 ms too long costs less than one that is 1 ms too short.
    pub delay: Milliseconds,
}

/// Interval family and gain of the paper's law, eqs. (7), (8) and (13).
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Σ: signs of the entries of J: -1, 0 or +1. Rows x, y, z; columns cable A, B and,
    /// in space, C.
    pub signs: PerAxis<MotorList<i8>>,
    /// α_ik: lower bound of |J_ik|; ignored where the sign is 0.
    pub alpha: PerAxis<MotorList<Bound>>,
    /// β_ik: upper bound of |J_ik|, at least α_ik; ignored where the sign is 0.
    pub beta: PerAxis<MotorList<Bound>>,
    /// Gain from v to motor rates.
    pub gain: Gain,
}

/// Sign pattern, eq. (12), of a rig whose motors are at one height.
pub const SIGNS: PerAxis<PerMotor<i8>> = [[-1, -1, 1], [-1, 1, 0], [-1, -1, -1]];

/// Sign pattern of a rig of two motors: y from B to A, and z, by cable A and B. It holds wherever
/// the ball is between the verticals of its motors (docs/understand/sign.md).
pub const PLANAR_SIGNS: PerAxis<[i8; LEAST_MOTORS]> = [[0, 0], [-1, 1], [-1, -1]];

impl Interval {
    /// Returns the family of eqs. (12) and (13) with the same bounds for every entry.
    pub const fn uniform(alpha: Bound, beta: Bound, gain: Gain) -> Self {
        Self::of_signs(SIGNS, alpha, beta, gain)
    }

    /// Returns the family of a rig of two motors with the same bounds for every entry.
    pub const fn planar(alpha: Bound, beta: Bound, gain: Gain) -> Self {
        Self::of_signs(PLANAR_SIGNS, alpha, beta, gain)
    }

    const fn of_signs<const N: usize>(
        [x, y, z]: PerAxis<[i8; N]>,
        alpha: Bound,
        beta: Bound,
        gain: Gain,
    ) -> Self {
        let signs = [MotorList::new(x), MotorList::new(y), MotorList::new(z)];
        let (alpha, beta) = (MotorList::new([alpha; N]), MotorList::new([beta; N]));
        Self { signs, alpha: [alpha; AXES], beta: [beta; AXES], gain }
    }
}

/// Limits of one motor.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Motor {
    /// Highest rate in either direction.
    pub max_rate: Rate,
    /// Highest acceleration and deceleration.
    pub max_acceleration: Acceleration,
    /// Lowest position, relative to the zero of travel: the motor's position at the board's start
    /// or at the last [`Home`](crate::Command::Home); at most 0.
    pub travel_min: Steps16,
    /// Highest position, relative to the same zero; at least 0.
    pub travel_max: Steps16,
    /// Whether the motor's direction is reversed: it pays out while the direction line
    /// is set to reel in.
    pub reversed: bool,
}

/// A box in the rig frame.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Workspace {
    /// Corner with the smallest coordinates.
    pub min: Point,
    /// Corner with the largest coordinates.
    pub max: Point,
}

impl Workspace {
    /// Returns whether `p` is inside or on the border.
    pub fn contains(&self, p: Point) -> bool {
        (0..3).all(|i| self.min.0[i] <= p.0[i] && p.0[i] <= self.max.0[i])
    }
}

/// Condition for a reached target: the ball rests within 0.9 of `radius`, by at least `frames`
/// consecutive positions, and by more of them where they are noisy.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reached {
    /// Required distance of the ball from the target.
    pub radius: Micrometres,
    /// Least number of consecutive positions.
    pub frames: u8,
}

/// Times after which the board stops by itself, and the highest age of a position.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// Longest time without a valid frame from the host while moving or holding.
    pub host: Milliseconds,
    /// Longest time without a fresh position while seeking or holding.
    pub position: Milliseconds,
    /// Highest age of a position at its arrival; older ones are refused. Below `position`.
    pub max_age: Milliseconds,
}

/// Limit of the error's growth: the board stops when |e| has been more than `margin` above that of
/// the nearest position for `time`.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Growth {
    /// Margin above the distance from the target to the nearest position of the drive so far. A
    /// change of the target does not forget that position.
    pub margin: Micrometres,
    /// Duration.
    pub time: Milliseconds,
}

/// Limit of the motors' turn without the ball: the board stops when a motor has turned by more than
/// `turn` while the ball has moved along no axis by more than `movement`.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Following {
    /// Difference of a motor's position, in either direction.
    pub turn: Steps16,
    /// Movement of the ball.
    pub movement: Micrometres,
}

/// Limit of the time without progress: the board stops when |e| is outside the radius of a reached
/// target and has not become smaller by `margin` for `time`.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Margin below the smallest |e| so far.
    pub margin: Micrometres,
    /// Duration.
    pub time: Milliseconds,
}

/// Limits of the reference of a [`Follow`](crate::Command::Follow). Where the host's path asks for
/// more, or jumps, the reference leaves it and comes back to it within these limits.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathLimits {
    /// Highest speed.
    pub speed: Speed,
    /// Highest acceleration.
    pub acceleration: PathAcceleration,
    /// Highest jerk.
    pub jerk: PathJerk,
    /// Filtered |e| at which a path that waits stands still. It slows down from half of it on.
    pub deviation: Micrometres,
}

/// Limits of a [`Jog`](crate::Command::Jog), besides those of its motor. No camera watches a jog.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq)]
pub struct JogLimits {
    /// Highest rate of a jog.
    pub max_rate: Rate,
    /// Longest distance of one jog, in either direction.
    pub max_distance: Steps16,
}

impl Config {
    /// Returns a configuration that every board accepts.
    ///
    /// Law `interval` with the paper's bounds (α = 0.005, β = 0.5) and γ = 30 /s at 0.471 mm of
    /// cable per step; motors with 400 steps/s, 2000 steps/s² and ±4000 steps of travel; 1/16
    /// steps; a workspace of 3 m × 3 m × 1.6 m. Examples and tests change single
    /// fields: `Config { law, ..Config::example() }`.
    pub const fn example() -> Self {
        const MOTOR: Motor = Motor {
            max_rate: Rate(400 << 8),
            max_acceleration: Acceleration(2000),
            travel_min: Steps16(-16 * 4000),
            travel_max: Steps16(16 * 4000),
            reversed: false,
        };
        Self {
            law: Law::Interval(Interval::uniform(Bound(328), Bound(1 << 15), Gain(4172))),
            motors: MotorList::new([MOTOR; MOTORS]),
            microsteps: 16,
            workspace: Workspace {
                min: Point([Micrometres(-1_000_000); AXES]),
                max: Point([Micrometres(2_000_000), Micrometres(2_000_000), Micrometres(600_000)]),
            },
            reached: Reached { radius: Micrometres(10_000), frames: 10 },
            deadlines: Deadlines {
                host: Milliseconds(300),
                position: Milliseconds(500),
                max_age: Milliseconds(250),
            },
            growth: Growth { margin: Micrometres(60_000), time: Milliseconds(600) },
            following: Following { turn: Steps16(16 * 400), movement: Micrometres(20_000) },
            progress: Progress { margin: Micrometres(1_000), time: Milliseconds(10_000) },
            jog: JogLimits { max_rate: Rate(400 << 8), max_distance: Steps16(16 * 8000) },
            path: PathLimits {
                speed: Speed(300_000),
                acceleration: PathAcceleration(1_000),
                jerk: PathJerk(10_000),
                deviation: Micrometres(20_000),
            },
            mean: Milliseconds(0),
        }
    }
}
