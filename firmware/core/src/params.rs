//! A configuration that was checked, and what the board was built for.

use plumb_protocol::config::{
    Coils, Config, Deadlines, Drivers, Growth, Law, Motor, Reached, Workspace,
};
use plumb_protocol::message::ConfigField;
use plumb_protocol::units::Point;

use crate::law::{Interval, Limits, Quick, Sign};
use crate::plan::{LONGEST_MEAN_MS, TICK_US};
use crate::segment::Timing;
use crate::think::Kind;

/// Limits that no configuration can lift: what the step generation of this board was built for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuildLimits {
    /// Highest pulse rate of one motor, microsteps/s; at most 1.25 million, which the planner's
    /// arithmetic has room for.
    pub max_pulse_rate: u32,
    /// Whether the board can keep a configuration over a loss of power.
    pub storage: bool,
}

/// A configuration within its ranges: the only way to one is [`Params::check`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Params {
    pub(crate) law: Law,
    pub(crate) motors: [Motor; 3],
    pub(crate) microsteps: u8,
    pub(crate) workspace: Workspace,
    pub(crate) reached: Reached,
    pub(crate) deadlines: Deadlines,
    pub(crate) growth: Growth,
    pub(crate) drivers: Drivers,
    pub(crate) mean_ms: u16,
}

/// A law that is configured: it answers in the tick in which a picture comes, or takes longer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Own {
    /// Before its first picture.
    Quick(Quick),
    /// For a [`Thinker`](crate::think::Thinker).
    Slow(Kind),
}

/// Bounds on J up to 8, Q16: what keeps the law's sums within 48 bits.
const MAX_BOUND: u32 = 8 << 16;
/// 16 steps/s a µm, Q16.
const MAX_GAIN: u32 = 16 << 16;
/// 1 step/s a µm, Q20.
const MAX_SIGN_GAIN: u32 = 1 << 20;
/// What the board remembers of its motors.
const MAX_DELAY_MS: u16 = 500;
/// 4 m, so that a difference of two points stays below 8.39 m.
const MAX_COORDINATE: i32 = 4_000_000;
/// 5 s.
const MAX_DEADLINE: u16 = 5_000;
/// Least acceleration, steps/s²: eight units of the planner's rate a tick even without microsteps.
const MIN_ACCELERATION: u32 = 40;
const MAX_ACCELERATION: u32 = 4_000_000;
/// Coils are set once a tick: half a full step of it at most, full steps/s.
const MAX_COIL_RATE: u32 = 1_000_000 / TICK_US / 2;
/// Three motors on the HATs' bus are set in 1.4 ms: about half a full step of it at most, full
/// steps/s.
const MAX_HAT_RATE: u32 = 300;
/// Travel up to ±32 million steps leaves room for the way to a stop in an i32.
const MAX_TRAVEL: i32 = 1 << 29;

impl Params {
    /// Checks every range.
    ///
    /// # Errors
    /// The first field that is out of its range.
    pub fn check(config: &Config, build: &BuildLimits) -> Result<Self, ConfigField> {
        check_law(&config.law)?;
        ensure(matches!(config.microsteps, 1 | 2 | 4 | 8 | 16), ConfigField::Microsteps)?;
        let max_pulse_rate =
            check_drivers(&config.drivers, config.microsteps)?.min(build.max_pulse_rate);
        for motor in &config.motors {
            check_motor(motor, config.microsteps, max_pulse_rate)?;
        }
        check_workspace(&config.workspace)?;
        let radius = config.reached.radius.0;
        ensure(
            (1..=1_000_000).contains(&radius) && config.reached.frames > 0,
            ConfigField::Reached,
        )?;
        let Deadlines { host, position, max_age } = config.deadlines;
        let in_range = |ms: u16| (1..=MAX_DEADLINE).contains(&ms);
        ensure(
            in_range(host.0) && in_range(position.0) && in_range(max_age.0),
            ConfigField::Deadlines,
        )?;
        ensure(max_age < position, ConfigField::MaxAge)?;
        ensure(config.growth.margin.0 > 0 && config.growth.time.0 > 0, ConfigField::Growth)?;
        ensure(config.mean.0 <= LONGEST_MEAN_MS, ConfigField::Mean)?;
        Ok(Self {
            law: config.law,
            motors: config.motors,
            microsteps: config.microsteps,
            workspace: config.workspace,
            reached: config.reached,
            deadlines: config.deadlines,
            growth: config.growth,
            drivers: config.drivers,
            mean_ms: config.mean.0,
        })
    }

    /// The law before its first picture.
    pub fn law(&self) -> Own {
        match &self.law {
            Law::Interval(law) => Own::Quick(Quick::Interval(Interval::new(law))),
            Law::Sign(law) => Own::Quick(Quick::Sign(Sign::new(law))),
            Law::Adaptive(_) => Own::Slow(Kind::Adaptive),
            Law::Taut(_) => Own::Slow(Kind::Taut),
        }
    }

    /// Which law it is, where it takes longer than a tick.
    pub fn slow(&self) -> Option<Kind> {
        match &self.law {
            Law::Interval(_) | Law::Sign(_) => None,
            Law::Adaptive(_) => Some(Kind::Adaptive),
            Law::Taut(_) => Some(Kind::Taut),
        }
    }

    /// The least of the motors' limits.
    pub fn limits(&self) -> Limits {
        Limits::of(&self.motors)
    }

    /// The interval law; `None` where another one is configured.
    pub fn interval(&self) -> Option<Interval> {
        match &self.law {
            Law::Interval(law) => Some(Interval::new(law)),
            _ => None,
        }
    }

    /// Delay of the pictures beyond their age, µs.
    pub(crate) fn delay_us(&self) -> u32 {
        match &self.law {
            Law::Interval(_) | Law::Sign(_) => 0,
            Law::Adaptive(law) | Law::Taut(law) => u32::from(law.delay.0) * 1000,
        }
    }

    /// The highest rate of each motor, Q8 steps/s.
    pub(crate) fn max_rates(&self) -> [i32; 3] {
        self.motors.map(|m| m.max_rate.0)
    }
}

fn ensure(condition: bool, field: ConfigField) -> Result<(), ConfigField> {
    if condition { Ok(()) } else { Err(field) }
}

fn check_law(law: &Law) -> Result<(), ConfigField> {
    match law {
        Law::Interval(law) => check_interval(law),
        Law::Sign(law) => ensure((1..=MAX_SIGN_GAIN).contains(&law.gain.0), ConfigField::Gain),
        Law::Adaptive(law) | Law::Taut(law) => {
            ensure(law.delay.0 <= MAX_DELAY_MS, ConfigField::Delay)
        }
    }
}

fn check_interval(law: &plumb_protocol::config::Interval) -> Result<(), ConfigField> {
    let signs = &law.signs;
    ensure(signs.iter().flatten().all(|s| (-1..=1).contains(s)), ConfigField::Signs)?;
    ensure((0..3).all(|k| signs.iter().any(|row| row[k] != 0)), ConfigField::Signs)?;
    for ((sign, alpha), beta) in
        signs.iter().flatten().zip(law.alpha.iter().flatten()).zip(law.beta.iter().flatten())
    {
        ensure(
            *sign == 0 || (0 < alpha.0 && alpha <= beta && beta.0 <= MAX_BOUND),
            ConfigField::Bounds,
        )?;
    }
    ensure((1..=MAX_GAIN).contains(&law.gain.0), ConfigField::Gain)
}

/// The highest pulse rate that the drivers can follow, microsteps/s.
fn check_drivers(drivers: &Drivers, microsteps: u8) -> Result<u32, ConfigField> {
    let share =
        |coils: &Coils| ensure((1..=100).contains(&coils.duty_percent), ConfigField::Drivers);
    match drivers {
        Drivers::StepDir(times) => {
            Ok(Timing::of(times).ok_or(ConfigField::Drivers)?.max_pulse_rate())
        }
        Drivers::Coils(coils) => share(coils).map(|()| MAX_COIL_RATE * u32::from(microsteps)),
        Drivers::MotorHats(coils) => share(coils).map(|()| MAX_HAT_RATE * u32::from(microsteps)),
    }
}

fn check_motor(motor: &Motor, microsteps: u8, max_pulse_rate: u32) -> Result<(), ConfigField> {
    let pulses_q8 = i64::from(motor.max_rate.0) * i64::from(microsteps);
    ensure(
        motor.max_rate.0 > 0 && pulses_q8 <= i64::from(max_pulse_rate) << 8,
        ConfigField::MaxRate,
    )?;
    ensure(
        (MIN_ACCELERATION..=MAX_ACCELERATION).contains(&motor.max_acceleration.0),
        ConfigField::MaxAcceleration,
    )?;
    let (min, max) = (motor.travel_min.0, motor.travel_max.0);
    ensure((-MAX_TRAVEL..=0).contains(&min) && (0..=MAX_TRAVEL).contains(&max), ConfigField::Travel)
}

fn check_workspace(workspace: &Workspace) -> Result<(), ConfigField> {
    let near =
        |p: Point| p.micrometres().iter().all(|c| (-MAX_COORDINATE..=MAX_COORDINATE).contains(c));
    let (min, max) = (workspace.min, workspace.max);
    let spans = (0..3).all(|i| min.0[i] < max.0[i]);
    ensure(near(min) && near(max) && spans, ConfigField::Workspace)
}
