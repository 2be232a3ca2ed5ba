//! The fields of a configuration and of what happens under it, each with its ends.

use std::collections::BTreeSet;

use plumb_core::timing::DriverTiming;
use plumb_protocol::Config;
use plumb_protocol::boards::PICO;
use plumb_protocol::config::*;
use plumb_protocol::units::*;
use plumb_protocol::wiring::{Coils, Drivers, StepDir, Tmc2209};

use super::FASTEST;
use crate::common::config;

/// Largest |coordinate|, µm.
const FAR: i32 = 4_000_000;
/// Widest travel, 1/16 steps.
const WIDEST: i32 = 1 << 29;

/// A configuration and what happens under it.
pub(super) struct Case {
    pub(super) drivers: Drivers,
    pub(super) config: Config,
    /// Clock of the board at the start, µs.
    pub(super) start: u64,
    /// Number before that of the first position; they wrap.
    pub(super) sequence: u16,
    /// Age of the positions, µs.
    pub(super) age_us: u32,
    pub(super) covariance: Option<Covariance>,
    /// Time between the knots of a path, µs.
    pub(super) interval_us: u32,
    /// Speed along each axis at the knots of a path, µm/s, to and fro.
    pub(super) speed: i32,
    /// The path's time at its first knot and in its first message, µs.
    pub(super) path_start: [u64; 2],
    /// States in which a motor turned.
    pub(super) moved: BTreeSet<&'static str>,
}

impl Case {
    pub(super) fn new() -> Self {
        Self {
            drivers: Drivers::StepDir(StepDir::TMC2209),
            config: config(),
            start: 0,
            sequence: 0,
            age_us: 0,
            covariance: None,
            interval_us: 10_000,
            speed: 0,
            path_start: [0, 0],
            moved: BTreeSet::new(),
        }
    }
}

/// Sets one field to one of its ends.
pub(super) type Setter = fn(&mut Case);

/// Returns the fields, each with its ends. A field comes after those that its ends depend on.
pub(super) fn fields() -> Vec<&'static [Setter]> {
    vec![
        &[
            |c| c.config.law = interval([1, 1], 1),
            |c| c.config.law = interval([1, 8 << 16], 16 << 16),
            |c| c.config.law = interval([8 << 16, 8 << 16], 16 << 16),
            |c| c.config.law = Law::Sign(Sign { gain: SignGain(1) }),
            |c| c.config.law = Law::Sign(Sign { gain: SignGain(1 << 20) }),
            |c| c.config.law = Law::Adaptive(Estimated { delay: Milliseconds(0) }),
            |c| c.config.law = Law::Adaptive(Estimated { delay: Milliseconds(500) }),
            |c| c.config.law = Law::Taut(Estimated { delay: Milliseconds(0) }),
            |c| c.config.law = Law::Taut(Estimated { delay: Milliseconds(500) }),
        ],
        &[
            |c| c.drivers = step_dir(0, 0, 0),
            |c| c.drivers = step_dir(4_100, u16::MAX, u16::MAX),
            |c| c.drivers = Drivers::Coils(Coils { duty_percent: 1 }),
            |c| c.drivers = Drivers::MotorHats(Coils { duty_percent: 100 }),
            |c| c.drivers = Drivers::Tmc2209(Tmc2209::of(&PICO)),
        ],
        &[|c| c.config.microsteps = 1, |c| c.config.microsteps = 16],
        // One motor at the other end than the two others shows what they share.
        &[
            |c| set_rates(c, [1, 1, 1]),
            |c| set_rates(c, [i32::MAX, 1, i32::MAX]),
            |c| set_rates(c, [i32::MAX; 3]),
        ],
        &[
            |c| c.config.motors.iter_mut().for_each(|m| m.max_acceleration = Acceleration(40)),
            |c| c.config.motors[1].max_acceleration = Acceleration(4_000_000),
            |c| {
                c.config
                    .motors
                    .iter_mut()
                    .for_each(|m| m.max_acceleration = Acceleration(4_000_000))
            },
        ],
        &[
            |c| set_travel(c, [0, 0]),
            |c| set_travel(c, [-WIDEST, 0]),
            |c| set_travel(c, [-WIDEST, WIDEST]),
        ],
        &[|c| c.config.motors[0].reversed = false, |c| c.config.motors[0].reversed = true],
        &[
            |c| set_workspace(c, [-FAR, FAR]),
            |c| set_workspace(c, [FAR - 1, FAR]),
            |c| set_workspace(c, [-FAR, 1 - FAR]),
        ],
        &[
            |c| c.config.reached = Reached { radius: Micrometres(1), frames: 255 },
            |c| c.config.reached = Reached { radius: Micrometres(1_000_000), frames: 1 },
        ],
        &[
            |c| c.config.deadlines.host = Milliseconds(1),
            |c| c.config.deadlines.host = Milliseconds(5_000),
        ],
        &[
            |c| set_position(c, 2, 1),
            |c| set_position(c, 5_000, 1),
            |c| set_position(c, 5_000, 4_999),
        ],
        &[
            |c| c.config.growth = Growth { margin: Micrometres(1), time: Milliseconds(5_000) },
            |c| c.config.growth = Growth { margin: Micrometres(1_000_000), time: Milliseconds(1) },
        ],
        &[
            |c| c.config.following = following(1, 1_000_000),
            |c| c.config.following = following(1_600_000, 5_000),
        ],
        &[
            |c| c.config.progress = progress(1, 60_000),
            |c| c.config.progress = progress(1_000_000, 1),
        ],
        &[
            |c| c.config.jog = JogLimits { max_rate: Rate(1), max_distance: Steps16(2 * WIDEST) },
            |c| c.config.jog = JogLimits { max_rate: Rate(i32::MAX), max_distance: Steps16(1) },
            |c| {
                let (max_rate, max_distance) = (Rate(i32::MAX), Steps16(2 * WIDEST));
                c.config.jog = JogLimits { max_rate, max_distance };
            },
        ],
        &[|c| c.config.mean = Milliseconds(0), |c| c.config.mean = Milliseconds(400)],
        &[
            |c| c.config.path = path(1, 1, 1, 1),
            |c| c.config.path = path(2_000_000, 1, 1_000_000, 1_000_000),
            |c| c.config.path = path(2_000_000, 20_000, 1, 1),
            |c| c.config.path = path(2_000_000, 20_000, 1_000_000, 1_000_000),
        ],
        &[|c| c.interval_us = 10_000, |c| c.interval_us = 500_000],
        &[|c| c.speed = 0, |c| c.speed = 2_000_000],
        &[
            |c| c.path_start = [0, 0],
            |c| c.path_start = [u64::MAX - 1_000_000; 2],
            |c| c.path_start = [u64::MAX, 0],
            |c| c.path_start = [0, u64::MAX],
        ],
        &[|c| c.start = 0, |c| c.start = (1 << 32) - 60_000, |c| c.start = 1 << 62],
        &[|c| c.sequence = 0, |c| c.sequence = u16::MAX - 20],
        &[|c| c.age_us = 0, |c| c.age_us = u32::from(c.config.deadlines.max_age.0) * 1_000],
        &[
            |c| c.covariance = None,
            |c| c.covariance = Some(Covariance { variances: [0; 3], covariances: [0; 3] }),
            |c| {
                let (variances, covariances) = ([u16::MAX; 3], [i16::MIN, i16::MAX, i16::MIN]);
                c.covariance = Some(Covariance { variances, covariances });
            },
        ],
    ]
}

fn interval([alpha, beta]: [u32; 2], gain: u32) -> Law {
    Law::Interval(Interval::uniform(Bound(alpha), Bound(beta), Gain(gain)))
}

fn step_dir(high: u16, low: u16, setup: u16) -> Drivers {
    let [high, low, setup] = [high, low, setup].map(Nanoseconds);
    let hold = Nanoseconds(high.0 / 2);
    Drivers::StepDir(StepDir { high, low, setup, hold, enable: Milliseconds(0) })
}

/// Sets the highest rates, Q8 steps/s, at most what drivers and build allow.
fn set_rates(case: &mut Case, rates: [i32; 3]) {
    let microsteps = u32::from(case.config.microsteps);
    let pulses = match &case.drivers {
        Drivers::StepDir(times) | Drivers::Tmc2209(Tmc2209 { times, .. }) => {
            DriverTiming::new(times).unwrap().max_pulse_rate()
        }
        Drivers::Coils(_) => 2_500 * microsteps,
        Drivers::MotorHats(_) => 300 * microsteps,
    };
    let pulses = u64::from(pulses.min(FASTEST.max_pulse_rate));
    let fastest = ((pulses << 8) / u64::from(microsteps)) as i32;
    for (motor, rate) in case.config.motors.iter_mut().zip(rates) {
        motor.max_rate = Rate(rate.min(fastest));
    }
}

fn set_travel(case: &mut Case, [min, max]: [i32; 2]) {
    for motor in &mut case.config.motors {
        (motor.travel_min, motor.travel_max) = (Steps16(min), Steps16(max));
    }
}

fn set_workspace(case: &mut Case, [min, max]: [i32; 2]) {
    let [min, max] = [min, max].map(|c| Point([Micrometres(c); 3]));
    case.config.workspace = Workspace { min, max };
}

fn set_position(case: &mut Case, position: u16, max_age: u16) {
    case.config.deadlines.position = Milliseconds(position);
    case.config.deadlines.max_age = Milliseconds(max_age);
}

/// Returns limits of paths: µm/s, mm/s², mm/s³, µm.
fn path(speed: i32, acceleration: u16, jerk: u32, deviation: i32) -> PathLimits {
    let (speed, acceleration) = (Speed(speed), PathAcceleration(acceleration));
    PathLimits { speed, acceleration, jerk: PathJerk(jerk), deviation: Micrometres(deviation) }
}

fn following(turn: i32, movement: i32) -> Following {
    Following { turn: Steps16(turn), movement: Micrometres(movement) }
}

fn progress(margin: i32, time: u16) -> Progress {
    Progress { margin: Micrometres(margin), time: Milliseconds(time) }
}
