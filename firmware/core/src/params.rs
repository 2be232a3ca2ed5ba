//! A configuration that was checked, and the limits of the build.

use plumb_protocol::boards::Chip;
use plumb_protocol::config::{self, Config, Deadlines, Law, Motor, PathLimits, Workspace};
use plumb_protocol::dimension::{AXES, LEAST_MOTORS, MOTORS, MotorList, PerMotor};
use plumb_protocol::message::{ConfigField, Refusal};
use plumb_protocol::units::{Micrometres, Point, Steps16};
use plumb_protocol::wiring::{Coils, Drivers, Tmc2209};

use crate::law::{DeferredLawKind, DeferredTicks, Interval, LawSelection, LawTicks, MotorLimits};
use crate::timing::{DriverTiming, MAX_MEAN_MS, TICK_US};
use crate::tmc2209;

/// Limits of the build, which no configuration can lift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuildLimits {
    /// Highest pulse rate of one motor, microsteps/s; at most 1.25 million, the limit of the
    /// planner's arithmetic.
    pub max_pulse_rate: u32,
    /// Whether the board can keep a configuration over a loss of power.
    pub storage: bool,
    /// The chip, whose boards it accepts; `None` for an emulated board, which accepts all.
    pub chip: Option<Chip>,
    /// Ticks after which the deferred laws respond.
    pub law_ticks: LawTicks,
}

/// A configuration within its ranges. [`Params::check`] is the only way to one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Params {
    pub(crate) config: Config,
    /// Limits of each motor; [`absent`] ones where the rig has fewer.
    pub(crate) motors: PerMotor<Motor>,
    /// Pulse timing of the step generator for the drivers.
    pub(crate) timing: DriverTiming,
    /// Ticks of the law, where it is a deferred one.
    pub(crate) law_ticks: Option<DeferredTicks>,
}

/// Largest bound on an entry of J: 8, Q16. It keeps the interval law's sums within 48 bits.
const MAX_BOUND: u32 = 8 << 16;
/// Largest gain of the interval law: 16 steps/s per µm, Q16.
const MAX_GAIN: u32 = 16 << 16;
/// Largest gain of the sign law: 1 step/s per µm, Q20.
const MAX_SIGN_GAIN: u32 = 1 << 20;
/// Longest delay beyond a position's age, ms: the planner's history of motor positions is as long.
const MAX_DELAY_MS: u16 = 500;
/// Largest coordinate, µm: 4 m, so that a difference of two points stays below 8.39 m (2^23 µm).
const MAX_COORDINATE_UM: i32 = 4_000_000;
/// Largest radius within which a target counts as reached, µm.
const MAX_REACHED_RADIUS_UM: i32 = 1_000_000;
/// Longest deadline, ms.
const MAX_DEADLINE_MS: u16 = 5_000;
/// Largest margin of the guards, µm.
const MAX_MARGIN_UM: i32 = 1_000_000;
/// Longest time for which the error may grow, ms.
const MAX_GROWTH_MS: u16 = 5_000;
/// Farthest turn of a motor without the ball, Q4 steps: 100 000 steps, half a metre of cable with
/// a gear of 100:1.
const MAX_TURN: i32 = 1_600_000;
/// Movement of a ball that follows, µm. Below 5 mm noise alone would pass for it.
const MOVEMENT_UM: core::ops::RangeInclusive<i32> = 5_000..=1_000_000;
/// Longest time from ENABLE to the first pulse, ms.
const MAX_ENABLE_MS: u16 = 200;
/// Longest time without progress, ms.
const MAX_PROGRESS_MS: u16 = 60_000;
/// Highest speed of a reference, µm/s.
const MAX_PATH_SPEED: i32 = 2_000_000;
/// Highest acceleration of a reference, mm/s².
const MAX_PATH_ACCELERATION: u16 = 20_000;
/// Highest jerk of a reference, mm/s³.
const MAX_PATH_JERK: u32 = 1_000_000;
/// Least acceleration, steps/s²: eight units of the planner's rate a tick even without microsteps.
pub(crate) const MIN_ACCELERATION: u32 = 40;
/// Largest acceleration, steps/s²: 22 bits in the planner.
pub(crate) const MAX_ACCELERATION: u32 = 4_000_000;
/// Highest rate of motors on coils, full steps/s: coils are set once a tick, and a motor follows
/// half a full step at most.
const MAX_COIL_RATE: u32 = 1_000_000 / TICK_US / 2;
/// Highest rate of motors on the HATs, full steps/s: three motors are set in 1.4 ms, about half a
/// full step at this rate.
const MAX_HAT_RATE: u32 = 300;
/// Largest travel, Q4 steps: ±32 million steps, which leaves room for the way to a stop in an i32.
pub(crate) const MAX_TRAVEL: i32 = 1 << 29;

impl Params {
    /// Checks every field of `config` against its range, what `drivers` allow, and the limits of
    /// the build.
    ///
    /// # Errors
    /// Returns the first field that is out of its range.
    #[cold]
    pub fn check(
        config: &Config,
        drivers: &Drivers,
        build: &BuildLimits,
    ) -> Result<Self, ConfigField> {
        let timing = check_fields(config, drivers, build, &mut Err)?;
        Ok(Self {
            config: *config,
            motors: config.motors.steppable(absent(&config.motors)),
            timing,
            law_ticks: DeferredLawKind::of(&config.law).map(|law| law.ticks(&build.law_ticks)),
        })
    }

    /// Calls `report` for every field of `config` that is out of its range, in the order of
    /// [`check`](Self::check). A field of three motors is reported up to three times.
    pub fn each_error(
        config: &Config,
        drivers: &Drivers,
        build: &BuildLimits,
        mut report: impl FnMut(ConfigField),
    ) {
        let mut go_on = |field| {
            report(field);
            Ok(())
        };
        // `go_on` ends no check.
        let _ = check_fields(config, drivers, build, &mut go_on);
    }

    /// Returns the configured law before its first measurement.
    pub fn law(&self) -> LawSelection {
        LawSelection::new(&self.config.law, self.motor_count())
    }

    /// Returns the kind of a deferred law; `None` where an inline one is configured.
    pub fn deferred_law(&self) -> Option<DeferredLawKind> {
        DeferredLawKind::of(&self.config.law)
    }

    /// Returns the number of the motors that the rig has.
    fn motor_count(&self) -> u8 {
        self.config.motors.len() as u8
    }

    /// Returns the least of the motors' limits.
    pub fn limits(&self) -> MotorLimits {
        MotorLimits::of(&self.motors, self.motor_count())
    }

    /// Returns the interval law; `None` where another one is configured.
    pub fn interval(&self) -> Option<Interval> {
        match &self.config.law {
            Law::Interval(law) => Some(Interval::new(law)),
            _ => None,
        }
    }

    /// Returns the delay of positions beyond their age, µs.
    pub(crate) fn delay_us(&self) -> u32 {
        match &self.config.law {
            Law::Interval(_) | Law::Sign(_) => 0,
            Law::Adaptive(law) | Law::Taut(law) => u32::from(law.delay.0) * 1000,
        }
    }

    /// Returns the highest rate of each motor, Q8 steps/s.
    pub(crate) fn max_rates(&self) -> PerMotor<i32> {
        self.motors.map(|m| m.max_rate.0)
    }

    /// Returns the limits of a motor; `None` where the rig has none of this index.
    pub(crate) fn motor(&self, index: usize) -> Option<&Motor> {
        self.config.motors.get(index)
    }

    /// Checks that no motor stands outside its travel; `positions` in 1/16 steps from its zero.
    ///
    /// # Errors
    /// [`Refusal::OutsideTravel`] with the first such motor.
    pub(crate) fn check_travel(&self, positions: PerMotor<i32>) -> Result<(), Refusal> {
        let outside = self
            .motors
            .iter()
            .zip(positions)
            .position(|(motor, at)| !(motor.travel_min.0..=motor.travel_max.0).contains(&at));
        outside.map_or(Ok(()), |motor| Err(Refusal::OutsideTravel(motor as u8)))
    }

    /// Returns `values` for the motors that the rig has.
    pub(crate) fn of_motors<T: Copy>(&self, values: PerMotor<T>) -> MotorList<T> {
        MotorList::new(values).up_to(self.config.motors.len())
    }
}

/// Returns the limits of a motor that the rig has not: it is never asked to turn, and wherever it
/// stands, it is within its travel.
fn absent(motors: &[Motor]) -> Motor {
    let first = motors.first().copied().unwrap_or_default();
    let (travel_min, travel_max) = (Steps16(-MAX_TRAVEL), Steps16(MAX_TRAVEL));
    Motor { travel_min, travel_max, ..first }
}

/// Checks every field. Calls `report` for each that is out of its range, and ends with its error if
/// it returns one. Returns the timing of the drivers.
fn check_fields(
    config: &Config,
    drivers: &Drivers,
    build: &BuildLimits,
    report: &mut impl Report,
) -> Result<DriverTiming, ConfigField> {
    let motors = config.motors.len();
    ensure((LEAST_MOTORS..=MOTORS).contains(&motors), ConfigField::Motors, report)?;
    check_law(&config.law, motors, report)?;
    ensure(matches!(config.microsteps, 1 | 2 | 4 | 8 | 16), ConfigField::Microsteps, report)?;
    let (driver_pulse_rate, timing) = check_drivers(drivers, config.microsteps, report)?;
    let max_pulse_rate = driver_pulse_rate.min(build.max_pulse_rate);
    for motor in &config.motors {
        check_motor(motor, config.microsteps, max_pulse_rate, report)?;
    }
    check_workspace(&config.workspace, motors, report)?;
    let radius = config.reached.radius.0;
    ensure(
        (1..=MAX_REACHED_RADIUS_UM).contains(&radius) && config.reached.frames > 0,
        ConfigField::Reached,
        report,
    )?;
    check_deadlines(&config.deadlines, report)?;
    check_guards(config, report)?;
    ensure(
        config.jog.max_rate.0 > 0 && (1..=2 * MAX_TRAVEL).contains(&config.jog.max_distance.0),
        ConfigField::Jog,
        report,
    )?;
    check_path(&config.path, report)?;
    ensure(config.mean.0 <= MAX_MEAN_MS, ConfigField::Mean, report)?;
    Ok(timing)
}

/// Receiver of the fields that are out of their range. An error ends the check.
trait Report: FnMut(ConfigField) -> Result<(), ConfigField> {}

impl<F: FnMut(ConfigField) -> Result<(), ConfigField>> Report for F {}

fn ensure(
    condition: bool,
    field: ConfigField,
    report: &mut impl Report,
) -> Result<(), ConfigField> {
    if condition { Ok(()) } else { report(field) }
}

fn check_law(law: &Law, motors: usize, report: &mut impl Report) -> Result<(), ConfigField> {
    let knows_so_few = !matches!(law, Law::Taut(_)) || motors == MOTORS;
    ensure(knows_so_few, ConfigField::Law, report)?;
    match law {
        Law::Interval(law) => check_interval(law, motors, report),
        Law::Sign(law) => {
            ensure((1..=MAX_SIGN_GAIN).contains(&law.gain.0), ConfigField::Gain, report)
        }
        Law::Adaptive(law) | Law::Taut(law) => {
            ensure(law.delay.0 <= MAX_DELAY_MS, ConfigField::Delay, report)
        }
    }
}

fn check_interval(
    law: &config::Interval,
    motors: usize,
    report: &mut impl Report,
) -> Result<(), ConfigField> {
    let signs = &law.signs;
    let is_whole = signs.iter().all(|row| row.len() == motors)
        && law.alpha.iter().chain(&law.beta).all(|row| row.len() == motors);
    let has_effect = |k: usize| signs.iter().any(|row| row.get(k).is_some_and(|sign| *sign != 0));
    let in_plane = motors == MOTORS || signs[0].iter().all(|sign| *sign == 0);
    ensure(
        is_whole
            && in_plane
            && signs.iter().flatten().all(|s| (-1..=1).contains(s))
            && (0..motors).all(has_effect),
        ConfigField::Signs,
        report,
    )?;
    let mut entries =
        signs.iter().flatten().zip(law.alpha.iter().flatten()).zip(law.beta.iter().flatten());
    let in_range = entries.all(|((sign, alpha), beta)| {
        *sign == 0 || (0 < alpha.0 && alpha <= beta && beta.0 <= MAX_BOUND)
    });
    ensure(in_range, ConfigField::Bounds, report)?;
    ensure((1..=MAX_GAIN).contains(&law.gain.0), ConfigField::Gain, report)
}

/// Returns the highest pulse rate that the drivers can follow, microsteps/s, and the generator's
/// timing for them. Drivers without a STEP input, and those that the generator cannot drive, get
/// the slowest timing.
fn check_drivers(
    drivers: &Drivers,
    microsteps: u8,
    report: &mut impl Report,
) -> Result<(u32, DriverTiming), ConfigField> {
    let mut coils = |coils: &Coils, max_rate: u32| {
        ensure((1..=100).contains(&coils.duty_percent), ConfigField::Drivers, report)?;
        Ok((max_rate * u32::from(microsteps), DriverTiming::SLOWEST))
    };
    match drivers {
        Drivers::StepDir(times) | Drivers::Tmc2209(Tmc2209 { times, .. }) => {
            let timing = DriverTiming::new(times);
            let has_settings =
                drivers.tmc2209().is_none_or(|it| tmc2209::Settings::new(it, microsteps).is_some());
            let in_range = timing.is_some() && times.enable.0 <= MAX_ENABLE_MS && has_settings;
            ensure(in_range, ConfigField::Drivers, report)?;
            let timing = timing.unwrap_or(DriverTiming::SLOWEST);
            Ok((timing.max_pulse_rate(), timing))
        }
        Drivers::Coils(settings) => coils(settings, MAX_COIL_RATE),
        Drivers::MotorHats(settings) => coils(settings, MAX_HAT_RATE),
    }
}

fn check_motor(
    motor: &Motor,
    microsteps: u8,
    max_pulse_rate: u32,
    report: &mut impl Report,
) -> Result<(), ConfigField> {
    let pulses_q8 = i64::from(motor.max_rate.0) * i64::from(microsteps);
    let is_slow = pulses_q8 <= i64::from(max_pulse_rate) << 8;
    ensure(motor.max_rate.0 > 0 && is_slow, ConfigField::MaxRate, report)?;
    ensure(
        (MIN_ACCELERATION..=MAX_ACCELERATION).contains(&motor.max_acceleration.0),
        ConfigField::MaxAcceleration,
        report,
    )?;
    let (min, max) = (motor.travel_min.0, motor.travel_max.0);
    ensure(
        (-MAX_TRAVEL..=0).contains(&min) && (0..=MAX_TRAVEL).contains(&max),
        ConfigField::Travel,
        report,
    )
}

#[cold]
fn check_guards(config: &Config, report: &mut impl Report) -> Result<(), ConfigField> {
    let Config { growth, following, progress, .. } = config;
    let in_range = |margin: Micrometres| (1..=MAX_MARGIN_UM).contains(&margin.0);
    ensure(
        in_range(growth.margin) && (1..=MAX_GROWTH_MS).contains(&growth.time.0),
        ConfigField::Growth,
        report,
    )?;
    ensure(
        (1..=MAX_TURN).contains(&following.turn.0) && MOVEMENT_UM.contains(&following.movement.0),
        ConfigField::Following,
        report,
    )?;
    ensure(
        in_range(progress.margin) && (1..=MAX_PROGRESS_MS).contains(&progress.time.0),
        ConfigField::Progress,
        report,
    )
}

fn check_path(path: &PathLimits, report: &mut impl Report) -> Result<(), ConfigField> {
    let PathLimits { speed, acceleration, jerk, deviation } = *path;
    let in_range = (1..=MAX_PATH_SPEED).contains(&speed.0)
        && (1..=MAX_PATH_ACCELERATION).contains(&acceleration.0)
        && (1..=MAX_PATH_JERK).contains(&jerk.0)
        && (1..=MAX_MARGIN_UM).contains(&deviation.0);
    ensure(in_range, ConfigField::Path, report)
}

fn check_workspace(
    workspace: &Workspace,
    motors: usize,
    report: &mut impl Report,
) -> Result<(), ConfigField> {
    let near = |p: Point| {
        p.micrometres().iter().all(|c| (-MAX_COORDINATE_UM..=MAX_COORDINATE_UM).contains(c))
    };
    let (min, max) = (workspace.min, workspace.max);
    // Two motors move the ball in the plane x = 0.
    let plane = usize::from(motors < MOTORS);
    let is_flat = [min, max].iter().all(|p| p.0[..plane].iter().all(|x| x.0 == 0));
    let spans = is_flat && (plane..AXES).all(|i| min.0[i] < max.0[i]);
    ensure(near(min) && near(max) && spans, ConfigField::Workspace, report)
}

fn check_deadlines(deadlines: &Deadlines, report: &mut impl Report) -> Result<(), ConfigField> {
    let Deadlines { host, position, max_age } = *deadlines;
    let in_range = |ms: u16| (1..=MAX_DEADLINE_MS).contains(&ms);
    ensure(
        in_range(host.0) && in_range(position.0) && in_range(max_age.0),
        ConfigField::Deadlines,
        report,
    )?;
    ensure(max_age < position, ConfigField::MaxAge, report)
}

#[cfg(test)]
mod arithmetic;
