//! What the tests of this crate start from: configurations, and a board on a [bench](bench::Bench).
#![allow(dead_code, reason = "each test file uses its part")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

pub(crate) mod bench;

use plumb_core::BuildLimits;
use plumb_core::params::Params;
use plumb_protocol::Config;
use plumb_protocol::config::{
    self, Deadlines, Drivers, Growth, Law, Motor, Reached, StepDir, Workspace,
};
use plumb_protocol::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, Point, Rate, Steps16,
};

pub(crate) const BUILD: BuildLimits = BuildLimits { max_pulse_rate: 1_000_000, storage: true };

/// The paper's bounds, γ in 1/s at 0.471 mm a step.
pub(crate) fn paper_interval(gamma: f64) -> config::Interval {
    let bound = |b| Bound::from_si(b).unwrap();
    config::Interval::uniform(bound(0.005), bound(0.5), Gain::from_si(gamma / 471.24).unwrap())
}

pub(crate) fn motor(rate: f64, acceleration: u32, travel: i32) -> Motor {
    Motor {
        max_rate: Rate::from_si(rate).unwrap(),
        max_acceleration: Acceleration(acceleration),
        travel_min: Steps16(-travel),
        travel_max: Steps16(travel),
        reversed: false,
    }
}

pub(crate) fn interval_config(interval: config::Interval) -> Config {
    Config {
        law: Law::Interval(interval),
        motors: [motor(400.0, 2000, 16 * 4000); 3],
        microsteps: 16,
        workspace: Workspace {
            min: Point::from_metres([-1.0, -1.0, -1.0]).unwrap(),
            max: Point::from_metres([2.0, 2.0, 0.6]).unwrap(),
        },
        reached: Reached { radius: Micrometres(10_000), frames: 10 },
        deadlines: Deadlines {
            host: Milliseconds(300),
            position: Milliseconds(500),
            max_age: Milliseconds(250),
        },
        growth: Growth { margin: Micrometres(60_000), time: Milliseconds(600) },
        drivers: Drivers::StepDir(StepDir::TMC2209),
        mean: Milliseconds(0),
    }
}

pub(crate) fn config() -> Config {
    interval_config(paper_interval(30.0))
}

pub(crate) fn params(config: Config) -> Params {
    Params::check(&config, &BUILD).unwrap()
}
