//! Check of a configuration: one field for the board, all of them for a host.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::ops::{Deref, DerefMut};

use plumb_core::params::Params;
use plumb_protocol::Config;
use plumb_protocol::config::{
    Deadlines, Estimated, Following, Growth, Interval, JogLimits, Law, Motor, PathLimits, Progress,
    Reached, Sign, Workspace,
};
use plumb_protocol::frame::encode;
use plumb_protocol::message::{Command, ConfigField, ToBoard};
use plumb_protocol::units::{
    Acceleration, Bound, Gain, Micrometres, Milliseconds, PathAcceleration, PathJerk, Point, Rate,
    SignGain, Speed, Steps16,
};

use plumb_protocol::wiring::{Coils, Drivers, StepDir};

use crate::common::{self, BUILD};

/// A configuration and its drivers.
struct Setup {
    config: Config,
    drivers: Drivers,
}

impl Deref for Setup {
    type Target = Config;

    fn deref(&self) -> &Config {
        &self.config
    }
}

impl DerefMut for Setup {
    fn deref_mut(&mut self) -> &mut Config {
        &mut self.config
    }
}

fn config() -> Setup {
    Setup { config: common::config(), drivers: common::wiring().drivers }
}

fn errors(setup: &Setup) -> Vec<ConfigField> {
    let mut errors = Vec::new();
    Params::each_error(setup, &setup.drivers, &BUILD, |field| errors.push(field));
    errors
}

#[test]
fn a_valid_configuration_has_no_error() {
    assert_eq!(errors(&config()), []);
}

#[test]
fn every_field_out_of_range_is_reported_and_the_board_names_the_first() {
    let mut config = config();
    let Law::Interval(law) = &mut config.law else { panic!("the law of these tests") };
    law.signs = [[0; 3].into(); 3];
    law.gain.0 = 0;
    config.microsteps = 17;
    config.drivers = Drivers::Coils(Coils { duty_percent: 0 });
    config.motors[1].travel_min = Steps16(1);
    config.motors[2].max_acceleration.0 = 0;
    config.workspace.min = config.workspace.max;
    config.reached.frames = 0;
    config.deadlines.max_age = config.deadlines.position;
    config.growth.margin = Micrometres(0);
    config.mean.0 = 401;
    let all = errors(&config);
    let expected = [
        ConfigField::Signs,
        ConfigField::Gain,
        ConfigField::Microsteps,
        ConfigField::Drivers,
        ConfigField::Travel,
        ConfigField::MaxAcceleration,
        ConfigField::Workspace,
        ConfigField::Reached,
        ConfigField::MaxAge,
        ConfigField::Growth,
        ConfigField::Mean,
    ];
    assert_eq!(all, expected);
    assert_eq!(Params::check(&config, &config.drivers, &BUILD), Err(all[0]));
}

/// End of a range.
struct End {
    /// Sets the value of a configuration.
    set: fn(&mut Setup, i32),
    /// Last value that is accepted.
    accepted: i32,
    /// First value that is refused.
    refused: i32,
    field: ConfigField,
}

const fn end(set: fn(&mut Setup, i32), ends: [i32; 2], field: ConfigField) -> End {
    End { set, accepted: ends[0], refused: ends[1], field }
}

fn milliseconds(value: i32) -> Milliseconds {
    Milliseconds(value as u16)
}

/// Sets drivers, and one motor's rate in full steps/s with full steps.
fn full_steps(config: &mut Setup, drivers: Drivers, rate: i32) {
    (config.drivers, config.microsteps) = (drivers, 1);
    for motor in &mut config.motors {
        motor.max_rate = Rate(256);
    }
    config.motors[2].max_rate = Rate(rate);
}

const COILS: Coils = Coils { duty_percent: 50 };
const TRAVEL: i32 = 1 << 29;
const FAR: i32 = 4_000_000;

/// Ends of the ranges of the law.
const LAW: &[End] = {
    fn interval(config: &mut Setup) -> &mut plumb_protocol::config::Interval {
        let Law::Interval(law) = &mut config.law else { panic!("the law of these tests") };
        law
    }
    fn sign_gain(config: &mut Setup, gain: i32) {
        config.law = Law::Sign(Sign { gain: SignGain(gain as u32) });
    }
    fn delay(config: &mut Setup, ms: i32) {
        config.law = Law::Taut(Estimated { delay: milliseconds(ms) });
    }
    const LARGEST: i32 = 8 << 16;
    &[
        end(|c, v| interval(c).gain = Gain(v as u32), [1, 0], ConfigField::Gain),
        end(
            |c, v| interval(c).gain = Gain(v as u32),
            [16 << 16, (16 << 16) + 1],
            ConfigField::Gain,
        ),
        end(sign_gain, [1, 0], ConfigField::Gain),
        end(sign_gain, [1 << 20, (1 << 20) + 1], ConfigField::Gain),
        end(|c, v| interval(c).alpha[0][0] = Bound(v as u32), [1, 0], ConfigField::Bounds),
        end(
            |c, v| interval(c).beta[2][1] = Bound(v as u32),
            [LARGEST, LARGEST + 1],
            ConfigField::Bounds,
        ),
        end(|c, v| interval(c).alpha[1][0] = Bound(v as u32), [1, LARGEST], ConfigField::Bounds),
        end(|c, v| interval(c).signs[0][2] = v as i8, [1, 2], ConfigField::Signs),
        end(|c, v| interval(c).signs[0][2] = v as i8, [-1, -2], ConfigField::Signs),
        // The third motor must have an effect.
        end(
            |c, v| (interval(c).signs[0][2], interval(c).signs[2][2]) = (v as i8, 0),
            [1, 0],
            ConfigField::Signs,
        ),
        end(delay, [0, 501], ConfigField::Delay),
        end(delay, [500, 501], ConfigField::Delay),
    ]
};

/// Ends of the ranges of motors and drivers.
const MOTORS: &[End] = {
    fn duty(config: &mut Setup, duty: i32) {
        config.drivers = Drivers::Coils(Coils { duty_percent: duty as u8 });
    }
    &[
        end(|c, v| c.microsteps = v as u8, [1, 0], ConfigField::Microsteps),
        end(|c, v| c.microsteps = v as u8, [16, 17], ConfigField::Microsteps),
        end(duty, [1, 0], ConfigField::Drivers),
        end(duty, [100, 101], ConfigField::Drivers),
        end(
            |c, v| full_steps(c, Drivers::Coils(COILS), v),
            [2500 << 8, (2500 << 8) + 1],
            ConfigField::MaxRate,
        ),
        end(
            |c, v| full_steps(c, Drivers::MotorHats(COILS), v),
            [300 << 8, (300 << 8) + 1],
            ConfigField::MaxRate,
        ),
        end(
            |c, v| full_steps(c, Drivers::StepDir(StepDir::TMC2209), v),
            [256, i32::MAX],
            ConfigField::MaxRate,
        ),
        end(|c, v| c.motors[0].max_rate = Rate(v), [1, 0], ConfigField::MaxRate),
        end(
            |c, v| c.motors[1].max_acceleration = Acceleration(v as u32),
            [40, 39],
            ConfigField::MaxAcceleration,
        ),
        end(
            |c, v| c.motors[2].max_acceleration = Acceleration(v as u32),
            [4_000_000, 4_000_001],
            ConfigField::MaxAcceleration,
        ),
        end(
            |c, v| c.motors[0].travel_min = Steps16(v),
            [-TRAVEL, -TRAVEL - 1],
            ConfigField::Travel,
        ),
        end(|c, v| c.motors[0].travel_min = Steps16(v), [0, 1], ConfigField::Travel),
        end(|c, v| c.motors[2].travel_max = Steps16(v), [TRAVEL, TRAVEL + 1], ConfigField::Travel),
        end(|c, v| c.motors[2].travel_max = Steps16(v), [0, -1], ConfigField::Travel),
    ]
};

/// Ends of the ranges of workspace, deadlines and guards.
const LIMITS: &[End] = {
    fn age_below_position(config: &mut Setup, age: i32) {
        config.deadlines.position = milliseconds(500);
        config.deadlines.max_age = milliseconds(age);
    }
    fn flat(config: &mut Setup, height: i32) {
        config.workspace.max.0[2] = Micrometres(config.workspace.min.0[2].0 + height);
    }
    &[
        end(|c, v| c.workspace.min.0[0] = Micrometres(v), [-FAR, -FAR - 1], ConfigField::Workspace),
        end(|c, v| c.workspace.max.0[1] = Micrometres(v), [FAR, FAR + 1], ConfigField::Workspace),
        end(flat, [1, 0], ConfigField::Workspace),
        end(|c, v| c.reached.radius = Micrometres(v), [1, 0], ConfigField::Reached),
        end(|c, v| c.reached.radius = Micrometres(v), [1_000_000, 1_000_001], ConfigField::Reached),
        end(|c, v| c.reached.frames = v as u8, [1, 0], ConfigField::Reached),
        end(|c, v| c.deadlines.host = milliseconds(v), [1, 0], ConfigField::Deadlines),
        end(|c, v| c.deadlines.host = milliseconds(v), [5_000, 5_001], ConfigField::Deadlines),
        end(|c, v| c.deadlines.position = milliseconds(v), [5_000, 5_001], ConfigField::Deadlines),
        end(|c, v| c.deadlines.max_age = milliseconds(v), [1, 0], ConfigField::Deadlines),
        end(age_below_position, [499, 500], ConfigField::MaxAge),
        end(|c, v| c.growth.margin = Micrometres(v), [1, 0], ConfigField::Growth),
        end(|c, v| c.growth.margin = Micrometres(v), [1_000_000, 1_000_001], ConfigField::Growth),
        end(|c, v| c.growth.time = milliseconds(v), [1, 0], ConfigField::Growth),
        end(|c, v| c.growth.time = milliseconds(v), [5_000, 5_001], ConfigField::Growth),
        end(|c, v| c.following.turn = Steps16(v), [1, 0], ConfigField::Following),
        end(|c, v| c.following.turn = Steps16(v), [1_600_000, 1_600_001], ConfigField::Following),
        end(|c, v| c.following.movement = Micrometres(v), [5_000, 4_999], ConfigField::Following),
        end(
            |c, v| c.following.movement = Micrometres(v),
            [1_000_000, 1_000_001],
            ConfigField::Following,
        ),
        end(|c, v| c.progress.margin = Micrometres(v), [1, 0], ConfigField::Progress),
        end(
            |c, v| c.progress.margin = Micrometres(v),
            [1_000_000, 1_000_001],
            ConfigField::Progress,
        ),
        end(|c, v| c.progress.time = milliseconds(v), [1, 0], ConfigField::Progress),
        end(|c, v| c.progress.time = milliseconds(v), [60_000, 60_001], ConfigField::Progress),
        end(|c, v| c.jog.max_rate = Rate(v), [1, 0], ConfigField::Jog),
        end(|c, v| c.jog.max_distance = Steps16(v), [1, 0], ConfigField::Jog),
        end(|c, v| c.jog.max_distance = Steps16(v), [2 * TRAVEL, 2 * TRAVEL + 1], ConfigField::Jog),
        end(|c, v| c.mean = milliseconds(v), [400, 401], ConfigField::Mean),
    ]
};

/// Ends of the ranges of a path.
const PATH: &[End] = &[
    end(|c, v| c.path.speed = Speed(v), [1, 0], ConfigField::Path),
    end(|c, v| c.path.speed = Speed(v), [2_000_000, 2_000_001], ConfigField::Path),
    end(|c, v| c.path.acceleration.0 = v as u16, [1, 0], ConfigField::Path),
    end(|c, v| c.path.acceleration.0 = v as u16, [20_000, 20_001], ConfigField::Path),
    end(|c, v| c.path.jerk.0 = v as u32, [1, 0], ConfigField::Path),
    end(|c, v| c.path.jerk.0 = v as u32, [1_000_000, 1_000_001], ConfigField::Path),
    end(|c, v| c.path.deviation = Micrometres(v), [1, 0], ConfigField::Path),
    end(|c, v| c.path.deviation = Micrometres(v), [1_000_000, 1_000_001], ConfigField::Path),
];

#[test]
fn every_range_has_the_ends_that_are_documented() {
    for (number, end) in [LAW, MOTORS, LIMITS, PATH].into_iter().flatten().enumerate() {
        let with = |value| {
            let mut config = config();
            (end.set)(&mut config, value);
            errors(&config)
        };
        let End { accepted, refused, field, .. } = *end;
        assert_eq!(with(accepted), [], "end {number}, {field:?}: {accepted}");
        assert_eq!(with(refused), [field], "end {number}, {field:?}: {refused}");
    }
}

/// Every value as far out as a board accepts it, so that its bytes are the most.
#[test]
fn the_largest_configuration_that_a_board_accepts_fits_a_frame() {
    let corner = |um: i32| Point([Micrometres(um); 3]);
    let motor = Motor {
        max_rate: Rate((1_000_000 << 8) - 1),
        max_acceleration: Acceleration(4_000_000),
        travel_min: Steps16(-(1 << 29)),
        travel_max: Steps16(1 << 29),
        reversed: true,
    };
    let (most, time) = (Micrometres(1_000_000), Milliseconds(5_000));
    let config = Config {
        law: Law::Interval(Interval::uniform(Bound(8 << 16), Bound(8 << 16), Gain(16 << 16))),
        motors: [motor; 3].into(),
        microsteps: 1,
        workspace: Workspace { min: corner(-4_000_000), max: corner(4_000_000) },
        reached: Reached { radius: most, frames: 255 },
        deadlines: Deadlines { host: time, position: time, max_age: Milliseconds(4_999) },
        growth: Growth { margin: most, time },
        following: Following { turn: Steps16(1_600_000), movement: most },
        progress: Progress { margin: most, time: Milliseconds(60_000) },
        jog: JogLimits { max_rate: Rate(i32::MAX), max_distance: Steps16(1 << 30) },
        path: PathLimits {
            speed: Speed(2_000_000),
            acceleration: PathAcceleration(20_000),
            jerk: PathJerk(1_000_000),
            deviation: most,
        },
        mean: Milliseconds(400),
    };
    Params::check(&config, &common::wiring().drivers, &BUILD).unwrap();
    let message = ToBoard { id: u16::MAX, command: Command::Configure(config) };
    assert!(encode(&message).is_ok());
}
