//! Configurations for the tests of this crate, and a board on a [bench](bench::Bench).
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

pub(crate) mod bench;
pub(crate) mod covering;
pub(crate) mod deferred_bench;

use plumb_core::BuildLimits;
use plumb_core::law::LawTicks;
use plumb_core::params::Params;
use plumb_protocol::boards::Chip;
use plumb_protocol::config::{self, Law, Motor};
use plumb_protocol::units::{Acceleration, Bound, Gain, Rate, Steps16};
use plumb_protocol::{Config, Wiring};

pub(crate) const BUILD: BuildLimits = BuildLimits {
    max_pulse_rate: 1_000_000,
    storage: true,
    chip: Some(Chip::Rp2040),
    law_ticks: LawTicks::RP2040,
};

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
    Config { law: Law::Interval(interval), ..Config::example() }
}

pub(crate) fn config() -> Config {
    Config::example()
}

/// Returns the wiring of a Pico with TMC2209 drivers.
pub(crate) fn wiring() -> Wiring {
    Wiring::example()
}

pub(crate) fn params(config: Config) -> Params {
    Params::check(&config, &wiring().drivers, &BUILD).unwrap()
}
