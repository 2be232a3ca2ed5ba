//! Stops at the end of the travel, with the wanted rates set anew all the time.

use plumb_core::MotorRates;
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_protocol::Config;
use plumb_protocol::config::{Drivers, Law, Motor, Sign, StepDir};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, SignGain, Steps16};

use crate::campaign::Outcome;
use crate::generate;
use crate::random::Random;

/// No motor passes its travel, not even by one pulse.
pub const WITHIN: &str = "within the travel";
/// A planner that has refused to go on comes to rest.
pub const RESTS: &str = "comes to rest";

/// Most ticks until a motor comes to the end of its travel, and until it rests after that.
const MOST_TICKS: u64 = 40_000;

/// How the wanted rates are set on the way to the end of the travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aim {
    /// Once.
    Once,
    /// The same rates again at 30 Hz.
    Repeated30Hz,
    /// The same rates again at every tick.
    RepeatedEveryTick,
    /// Other rates of the same sign at every tick.
    OtherEveryTick,
}

impl Aim {
    const ALL: [Self; 4] = [Self::Once, Self::Repeated30Hz, Self::RepeatedEveryTick, Self::OtherEveryTick];

    /// Ticks from one setting to the next.
    fn period(self) -> u64 {
        match self {
            Self::Once => u64::MAX,
            Self::Repeated30Hz => 166,
            Self::RepeatedEveryTick | Self::OtherEveryTick => 1,
        }
    }
}

/// Runs `stops` stops with the randomness of one seed.
pub fn run(seed: u64, stops: u64, outcome: &mut Outcome) {
    let mut random = Random::new(seed);
    for stop in 0..stops {
        outcome.tick = stop;
        let config = config(&mut random);
        match Params::check(&config, &generate::build(true), [0; 3]) {
            Ok(params) => one_stop(&mut random, &config, &params, outcome),
            Err(field) => unreachable!("the configuration is within its ranges: {field}"),
        }
    }
}

/// Returns motors that reach the end of their travel soon.
fn config(random: &mut Random) -> Config {
    let rate = random.range(20, 1000);
    let acceleration = random.range(500, 50_000);
    let motor = |random: &mut Random| Motor {
        max_rate: Rate((rate << 8) as i32),
        max_acceleration: Acceleration(acceleration as u32),
        travel_min: Steps16(-random.range(0, 16 * 60) as i32),
        travel_max: Steps16(random.range(0, 16 * 60) as i32),
        reversed: random.percent(50),
    };
    Config {
        law: Law::Sign(Sign { gain: SignGain(1000) }),
        motors: [motor(random), motor(random), motor(random)],
        microsteps: random.pick(&[1, 2, 4, 8, 16, 16, 16]),
        drivers: Drivers::StepDir(StepDir::TMC2209),
        mean: Milliseconds(random.pick(&[0, 0, 1, 20, 100, 300])),
        ..generate::usual(random)
    }
}

/// Drives the motors towards an end of their travel until the planner refuses, and on until they
/// rest.
fn one_stop(random: &mut Random, config: &Config, params: &Params, outcome: &mut Outcome) {
    let mut planner = Planner::default();
    planner.configure(params);
    let aim = random.pick(&Aim::ALL);
    let directions = [0; 3].map(|_| random.range(-1, 1) as i32);
    let mut wanted = rates(random, config, directions);
    let mut beyond = false;
    let mut ticks = 0;
    for tick in 0..MOST_TICKS {
        ticks = tick;
        if tick % aim.period() == 0 {
            if aim == Aim::OtherEveryTick {
                wanted = rates(random, config, directions);
            }
            planner.aim(if beyond { MotorRates::default() } else { wanted }, 0);
        }
        if planner.tick().is_some() && !beyond {
            beyond = true;
            // The board aims at rest after a fault.
            planner.aim(MotorRates::default(), 0);
        }
        check(&planner, config, aim, outcome);
        if beyond && !planner.moving() {
            break;
        }
    }
    outcome.tally.add("ticks", ticks);
    outcome.tally.add("stops", beyond.into());
    if beyond {
        outcome.tally.add(if config.mean.0 == 0 { "stops without mean" } else { "stops through a mean" }, 1);
        outcome.tally.count(match aim {
            Aim::Once => "aimed once",
            Aim::Repeated30Hz => "aimed at 30 Hz",
            Aim::RepeatedEveryTick => "aimed at every tick",
            Aim::OtherEveryTick => "aimed elsewhere at every tick",
        });
    }
    outcome.check(!beyond || !planner.moving(), RESTS, || format!("{aim:?}, {:?}", config.motors));
}

fn rates(random: &mut Random, config: &Config, directions: [i32; 3]) -> MotorRates {
    let rate = |i: usize| directions[i] * random.corner(1, config.motors[i].max_rate.0.into()) as i32;
    MotorRates([0, 1, 2].map(rate))
}

fn check(planner: &Planner, config: &Config, aim: Aim, outcome: &mut Outcome) {
    let positions = planner.positions();
    let over = |i: usize| {
        let motor = &config.motors[i];
        (positions[i] - motor.travel_max.0).max(motor.travel_min.0 - positions[i])
    };
    if let Some(motor) = (0..3).find(|&i| over(i) > 0) {
        outcome.broken(WITHIN, || {
            let by = over(motor);
            let limits = config.motors[motor];
            let (microsteps, mean) = (config.microsteps, config.mean.0);
            format!(
                "motor {motor} by {by}/16 steps, {aim:?}, {microsteps} microsteps, mean {mean} ms, {limits:?}"
            )
        });
    }
}
