//! Motor limits that all benchmarks share, and a board configuration with them.

use plumb_protocol::config::{Config, Deadlines, JogLimits, Law, Motor, Reached, Workspace};
use plumb_protocol::units::{Acceleration, Micrometres, Milliseconds, Point, Rate, Steps16};
use plumb_protocol::{AXES, MOTORS, MotorList};

/// Limits of each motor of a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigLimits {
    /// Greatest rate, full steps/s.
    pub rate: f64,
    /// Greatest acceleration, full steps/s².
    pub acceleration: f64,
}

impl Default for RigLimits {
    /// docs/understand/method.md: 400 full steps/s, 2000 steps/s².
    fn default() -> Self {
        Self { rate: 400.0, acceleration: 2000.0 }
    }
}

/// Half the width of the largest workspace that a board accepts, µm.
const MAX_WORKSPACE: i32 = 4_000_000;

impl RigLimits {
    /// Returns a configuration with the widest travel and workspace. The guards are those of
    /// [`Config::example`]: a benchmark also shows that they stop no healthy rig.
    pub fn config(&self, law: Law, mean: Milliseconds, threshold_m: f64) -> Config {
        let motor = Motor {
            max_rate: Rate((self.rate * 256.0) as i32),
            max_acceleration: Acceleration(self.acceleration as u32),
            travel_min: Steps16(-(1 << 29)),
            travel_max: Steps16(1 << 29),
            reversed: false,
        };
        let example = Config::example();
        Config {
            law,
            motors: MotorList::new([motor; MOTORS]),
            microsteps: 16,
            workspace: Workspace {
                min: Point([Micrometres(-MAX_WORKSPACE); AXES]),
                max: Point([Micrometres(MAX_WORKSPACE); AXES]),
            },
            reached: Reached { radius: Micrometres((threshold_m * 1e6) as i32), frames: 4 },
            deadlines: Deadlines {
                host: Milliseconds(1_000),
                position: Milliseconds(500),
                max_age: Milliseconds(499),
            },
            growth: example.growth,
            following: example.following,
            progress: example.progress,
            jog: JogLimits { max_rate: motor.max_rate, max_distance: Steps16(1 << 30) },
            path: example.path,
            mean,
        }
    }
}
