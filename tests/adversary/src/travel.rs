//! Stops at the end of the travel, with new setpoints all the time.

use plumb_core::MotorRates;
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_protocol::config::{Law, Motor, Sign};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, SignGain, Steps16};
use plumb_protocol::wiring::{Drivers, StepDir};
use plumb_protocol::{Config, MotorList};

use crate::campaign::Outcome;
use crate::generate;
use crate::random::Random;

/// No motor passes the end of its travel, not even by one pulse. One that the rig has not stands.
pub const WITHIN: &str = "within the travel";
/// After a travel fault the planner comes to rest.
pub const RESTS: &str = "comes to rest";

/// A planner that reports rest has no motion left, not even in its moving average.
pub const STAYS: &str = "rest is rest";

/// The drivers.
const DRIVERS: Drivers = Drivers::StepDir(StepDir::TMC2209);
/// Length of the longest moving average, ticks.
const LONGEST_MEAN_TICKS: u64 = 2100;

/// Maximum number of ticks to the end of the travel: at least 2 s at an eighth of the rate.
const MOST_TICKS_THERE: u64 = 10_000;
/// Maximum number of ticks to rest after that: the longest ramp, 2 s, and the lag of the longest
/// moving average.
const MOST_TICKS_TO_REST: u64 = 14_000;

/// Pattern of setpoints on the way to the end of the travel.
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
    /// Any rates, or zero, at any time: stops by the host near the end of the travel.
    Wander,
}

impl Aim {
    const ALL: [Self; 5] = [
        Self::Once,
        Self::Repeated30Hz,
        Self::RepeatedEveryTick,
        Self::OtherEveryTick,
        Self::Wander,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Once => "aimed once",
            Self::Repeated30Hz => "aimed at 30 Hz",
            Self::RepeatedEveryTick => "aimed at every tick",
            Self::OtherEveryTick => "aimed elsewhere at every tick",
            Self::Wander => "aimed anywhere at any time",
        }
    }

    /// Returns the ticks between setpoints.
    fn period(self) -> u64 {
        match self {
            Self::Once => u64::MAX,
            Self::Repeated30Hz => 166,
            Self::RepeatedEveryTick | Self::OtherEveryTick => 1,
            Self::Wander => 80,
        }
    }
}

/// Runs `stops` stops of one seed.
pub fn run(seed: u64, stops: u64, outcome: &mut Outcome) {
    let mut random = Random::new(seed);
    for stop in 0..stops {
        outcome.tick = stop;
        let config = config(&mut random);
        match Params::check(&config, &DRIVERS, &generate::build(true)) {
            Ok(params) if random.one_in(20) => {
                there_and_back(&mut random, &config, &params, outcome)
            }
            Ok(params) => one_stop(&mut random, &config, &params, outcome),
            Err(field) => unreachable!("the configuration is within its ranges: {field}"),
        }
    }
}

/// Returns a configuration whose motors reach the end of their travel soon.
fn config(random: &mut Random) -> Config {
    let slow = random.percent(20);
    let rate = if slow { random.range(1, 10) } else { random.range(20, 1000) };
    let acceleration = random.range(500, 50_000);
    let travel = if slow || random.percent(20) { 20 } else { 16 * 60 };
    let motor = |random: &mut Random| Motor {
        max_rate: Rate((rate << 8) as i32),
        max_acceleration: Acceleration(acceleration as u32),
        travel_min: Steps16(-random.range(0, travel) as i32),
        travel_max: Steps16(random.range(0, travel) as i32),
        reversed: random.percent(50),
    };
    let motors = MotorList::new([motor(random), motor(random), motor(random)]);
    let typical = generate::typical(random);
    Config {
        law: Law::Sign(Sign { gain: SignGain(1000) }),
        motors: motors.up_to(typical.motors.len()),
        microsteps: random.pick(&[1, 2, 4, 8, 16, 16, 16]),
        mean: Milliseconds(if random.percent(30) { 0 } else { random.corner(1, 400) as u16 }),
        ..typical
    }
}

/// Motors that move to the end of their travel.
struct Approach<'a> {
    planner: Planner,
    config: &'a Config,
    aim: Aim,
    directions: [i32; 3],
    setpoint: MotorRates,
    /// Whether a motor has passed its travel.
    passed: bool,
    ticks: u64,
}

/// Drives the motors to an end of their travel until the planner reports it, then until they rest.
fn one_stop(random: &mut Random, config: &Config, params: &Params, outcome: &mut Outcome) {
    let mut planner = Planner::default();
    planner.configure(params);
    let directions = [0; 3].map(|_| random.range(-1, 1) as i32);
    let setpoint = rates(random, config, directions);
    let aim = random.pick(&Aim::ALL);
    let mut approach =
        Approach { planner, config, aim, directions, setpoint, passed: false, ticks: 0 };
    if approach.drive_to_the_end(random, outcome) {
        approach.drive_to_rest(outcome);
        approach.count(outcome);
    }
    outcome.tally.add("ticks", approach.ticks);
}

/// Drives the motors for some ticks, and back for as many: the sum of the steps is 0. Checks that
/// the motors rest once the planner reports rest.
fn there_and_back(random: &mut Random, config: &Config, params: &Params, outcome: &mut Outcome) {
    let mut planner = Planner::default();
    planner.configure(params);
    let there = rates(random, config, [1, -1, 1]);
    let back = MotorRates(there.0.map(|rate| -rate));
    let (turning, resting) = (random.range(1, 200), random.range(0, 200));
    for (setpoint, ticks) in [(there, turning), (MotorRates::default(), resting), (back, turning)] {
        planner.set_rates(setpoint, 0);
        for _ in 0..ticks {
            planner.tick();
        }
    }
    planner.set_rates(MotorRates::default(), 0);
    for _ in 0..MOST_TICKS_TO_REST {
        if !planner.moving() {
            break;
        }
        planner.tick();
    }
    outcome.tally.count("there and back");
    let positions = planner.positions();
    for tick in 0..LONGEST_MEAN_TICKS {
        planner.tick();
        outcome.check(planner.positions() == positions && planner.rates() == [0; 3], STAYS, || {
            let (rates, mean) = (planner.rates(), config.mean.0);
            format!("{rates:?} Q8 steps/s {tick} ticks after it came to rest, mean {mean} ms")
        });
    }
}

fn rates(random: &mut Random, config: &Config, directions: [i32; 3]) -> MotorRates {
    let rate = |i: usize| {
        let most = config.motors.get(i).map_or(0, |motor| motor.max_rate.0);
        directions[i] * random.range(i64::from(most / 8), most.into()) as i32
    };
    MotorRates([0, 1, 2].map(rate))
}

impl Approach<'_> {
    /// Drives until the planner reports the end of the travel. Returns whether it did.
    fn drive_to_the_end(&mut self, random: &mut Random, outcome: &mut Outcome) -> bool {
        for tick in 0..MOST_TICKS_THERE {
            self.set_rates(random, tick);
            let refused = self.planner.tick().is_some();
            self.ticks += 1;
            self.check(outcome);
            if refused {
                return true;
            }
        }
        false
    }

    /// Sets new rates if they are due.
    fn set_rates(&mut self, random: &mut Random, tick: u64) {
        let due = match self.aim {
            Aim::Wander => tick == 0 || random.one_in(self.aim.period()),
            _ => tick.is_multiple_of(self.aim.period()),
        };
        if !due {
            return;
        }
        match self.aim {
            Aim::OtherEveryTick => self.setpoint = rates(random, self.config, self.directions),
            Aim::Wander => {
                self.directions = [0; 3].map(|_| random.range(-1, 1) as i32);
                self.setpoint = rates(random, self.config, self.directions);
            }
            Aim::Once | Aim::Repeated30Hz | Aim::RepeatedEveryTick => {}
        }
        self.planner.set_rates(self.setpoint, 0);
    }

    /// Sets the rates to 0, as the board does after a fault, until the motors rest.
    fn drive_to_rest(&mut self, outcome: &mut Outcome) {
        self.planner.set_rates(MotorRates::default(), 0);
        for tick in 0..MOST_TICKS_TO_REST {
            if !self.planner.moving() {
                return;
            }
            if tick % self.aim.period() == 0 {
                self.planner.set_rates(MotorRates::default(), 0);
            }
            self.planner.tick();
            self.ticks += 1;
            self.check(outcome);
        }
        outcome.broken(RESTS, || format!("{:?}, {:?}", self.aim, self.config.motors));
    }

    /// Checks that no motor is beyond its travel.
    fn check(&mut self, outcome: &mut Outcome) {
        let positions = self.planner.positions();
        let over = |i: usize| match self.config.motors.get(i) {
            Some(motor) => {
                (positions[i] - motor.travel_max.0).max(motor.travel_min.0 - positions[i])
            }
            None => positions[i].abs(),
        };
        let Some(motor) = (0..3).find(|&i| over(i) > 0) else { return };
        self.passed = true;
        outcome.broken(WITHIN, || {
            let (microsteps, mean) = (self.config.microsteps, self.config.mean.0);
            let limits = self.config.motors.get(motor);
            format!(
                "motor {motor} by {}/16 steps, {:?}, {microsteps} microsteps, mean {mean} ms, \
                 {limits:?}",
                over(motor),
                self.aim
            )
        });
    }

    fn count(&self, outcome: &mut Outcome) {
        let tally = &mut outcome.tally;
        tally.count("stops");
        tally.count(if self.config.mean.0 == 0 {
            "stops without mean"
        } else {
            "stops through a mean"
        });
        tally.count(self.aim.name());
        tally.add("stops beyond the travel", self.passed.into());
        if self.passed {
            tally.count(&format!("stops beyond the travel, {}", self.aim.name()));
        }
    }
}
