//! A valid configuration, for examples and tests.

use super::{
    Config, Deadlines, Drivers, Following, Growth, Interval, JogLimits, Law, Motor, PathLimits,
    Progress, Reached, StepDir, Workspace,
};
use crate::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, PathAcceleration, PathJerk, Point, Rate,
    Speed, Steps16,
};

impl Config {
    /// Returns a configuration that every board accepts.
    ///
    /// Law `interval` with the paper's bounds (α = 0.005, β = 0.5) and γ = 30 /s at 0.471 mm of
    /// cable per step; motors with 400 steps/s, 2000 steps/s² and ±4000 steps of travel; TMC2209
    /// drivers at 1/16 steps; a workspace of 3 m × 3 m × 1.6 m. Examples and tests change single
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
            motors: [MOTOR; 3],
            microsteps: 16,
            workspace: Workspace {
                min: Point([Micrometres(-1_000_000); 3]),
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
            drivers: Drivers::StepDir(StepDir::TMC2209),
            mean: Milliseconds(0),
        }
    }
}
