//! Random configurations: typical ones, valid ones over the whole ranges, and invalid ones.

use plumb_core::BuildLimits;
use plumb_core::config_store::Stored;
use plumb_core::law::LawTicks;
use plumb_core::timing::DriverTiming;
use plumb_protocol::boards::{self, Chip};
use plumb_protocol::config::*;
use plumb_protocol::dimension::{LEAST_MOTORS, MOTORS, MotorList};
use plumb_protocol::message::{Knot, Reference};
use plumb_protocol::prior::{JacobianPrior, Prior, RigPrior};
use plumb_protocol::units::*;
use plumb_protocol::wiring::*;
use plumb_protocol::{Config, Wiring};

use crate::random::Random;

/// Maximum |position| of a travel, 1/16 steps.
const MAX_TRAVEL: i64 = 1 << 29;
/// Maximum |coordinate| of a workspace, µm.
const MAX_COORDINATE: i64 = 4_000_000;
/// Maximum bound of law `interval`, Q16.
const MAX_BOUND: i64 = 8 << 16;
/// Maximum deadline, ms.
const MAX_DEADLINE: i64 = 5_000;
/// Highest full-step rates of coils and of Motor HATs, full steps/s.
const MAX_COIL_RATE: u32 = 2_500;
const MAX_HAT_RATE: u32 = 300;

/// Returns the limits of the build: the pulse rate of the Pico's firmware.
pub const fn build(storage: bool) -> BuildLimits {
    BuildLimits {
        max_pulse_rate: 1_250_000,
        storage,
        chip: Some(Chip::Rp2040),
        law_ticks: LawTicks::RP2040,
    }
}

/// Returns the number of a rig's motors: two in a third of the cases.
fn motor_count(random: &mut Random) -> usize {
    if random.one_in(3) { LEAST_MOTORS } else { MOTORS }
}

/// Returns a Pico with TMC2209 drivers, and a configuration for a rig of typical size, with a
/// stable loop.
pub fn typical_setup(random: &mut Random) -> Stored {
    let config = typical(random);
    Stored { wiring: Wiring::example().of_motors(config.motors.len()), config }
}

/// Returns a configuration for a rig of typical size, with a stable loop.
pub fn typical(random: &mut Random) -> Config {
    let count = motor_count(random);
    let travel = if random.percent(25) { 16 * random.range(5, 40) } else { 16 * 4000 } as i32;
    let example = Config::example();
    let motor = example.motors[0];
    let motor = Motor { travel_min: Steps16(-travel), travel_max: Steps16(travel), ..motor };
    let corner = |metres: [i32; 3]| Point(metres.map(|c| Micrometres(c * 100_000)));
    let workspace = Workspace { min: corner([-10, -10, -10]), max: corner([20, 20, 10]) };
    Config {
        law: typical_law(random, count),
        motors: MotorList::from_fn(count, |_| motor),
        workspace: reachable(workspace, count),
        reached: Reached {
            radius: Micrometres(random.range(10_000, 50_000) as i32),
            frames: random.range(1, 10) as u8,
        },
        mean: Milliseconds(random.pick(&[0, 0, 0, 100, 300])),
        ..example
    }
}

/// Returns the part of a workspace that as many motors reach: two that in the plane x = 0.
fn reachable(mut workspace: Workspace, count: usize) -> Workspace {
    if count < MOTORS {
        (workspace.min.0[0], workspace.max.0[0]) = Default::default();
    }
    workspace
}

fn typical_law(random: &mut Random, count: usize) -> Law {
    match random.below(4) {
        // α 0.005, β 0.5, γ 30 /s; g 4 /s; both at 0.471 mm per step.
        0 => Law::Interval(family(count, Bound(328), Bound(32_768), Gain(4172))),
        1 => Law::Sign(Sign { gain: SignGain(2225) }),
        2 => Law::Adaptive(Estimated { delay: Milliseconds(5) }),
        _ => taut(count, 5),
    }
}

/// Returns law `taut` with this delay, ms; law `adaptive` for two motors.
fn taut(count: usize, delay: u16) -> Law {
    let estimated = Estimated { delay: Milliseconds(delay) };
    if count < MOTORS { Law::Adaptive(estimated) } else { Law::Taut(estimated) }
}

/// Returns the family of law `interval` for as many motors.
fn family(count: usize, alpha: Bound, beta: Bound, gain: Gain) -> Interval {
    if count < MOTORS {
        Interval::planar(alpha, beta, gain)
    } else {
        Interval::uniform(alpha, beta, gain)
    }
}

/// Returns a valid wiring, and a valid configuration whose travel contains `positions`.
pub fn accepted(random: &mut Random, positions: [i32; 3]) -> Stored {
    let count = motor_count(random);
    let microsteps = random.pick(&[1, 2, 4, 8, 16]);
    let wiring = wiring(random).of_motors(count);
    let max_rate = max_rate(&wiring.drivers, microsteps);
    let alike = random.percent(40);
    let first = motor(random, max_rate);
    let motors = positions.map(|position| {
        let mut motor = if alike { first } else { motor(random, max_rate) };
        motor.travel_min.0 = motor.travel_min.0.min(position);
        motor.travel_max.0 = motor.travel_max.0.max(position);
        motor
    });
    let config = Config {
        law: law(random, count),
        motors: MotorList::new(motors).up_to(count),
        microsteps,
        workspace: reachable(workspace(random), count),
        reached: Reached {
            radius: Micrometres(random.corner(1, 1_000_000) as i32),
            frames: random.corner(1, 255) as u8,
        },
        deadlines: deadlines(random),
        growth: growth(random),
        following: following(random),
        progress: progress(random),
        jog: jog_limits(random),
        path: path_limits(random),
        mean: Milliseconds(if random.percent(40) { 0 } else { random.corner(0, 400) as u16 }),
    };
    Stored { wiring, config }
}

/// Returns a Pico with any drivers, or an SKR Pico.
fn wiring(random: &mut Random) -> Wiring {
    let drivers = drivers(random);
    let is_skr_pico = drivers.step_dir().is_some() && random.percent(25);
    if !is_skr_pico {
        return Wiring::pico(drivers);
    }
    let drivers = match drivers {
        Drivers::Tmc2209(_) => Drivers::Tmc2209(Tmc2209::of(&boards::SKR_PICO)),
        drivers => drivers,
    };
    Wiring { board: boards::SKR_PICO.kind, pins: boards::SKR_PICO.pins, drivers }
}

fn drivers(random: &mut Random) -> Drivers {
    let coils = |random: &mut Random| Coils { duty_percent: random.corner(1, 100) as u8 };
    match random.below(9) {
        8 => Drivers::Tmc2209(Tmc2209::of(&boards::PICO)),
        0 => Drivers::Coils(coils(random)),
        1 => Drivers::MotorHats(coils(random)),
        2 => Drivers::StepDir(StepDir::A4988),
        3 => Drivers::StepDir(StepDir::DRV8825),
        4 | 5 => Drivers::StepDir(StepDir::TMC2209),
        _ => Drivers::StepDir(StepDir {
            high: Nanoseconds(random.corner(0, 4100) as u16),
            low: Nanoseconds(random.corner(0, 65_535) as u16),
            setup: Nanoseconds(random.corner(0, 65_535) as u16),
            hold: Nanoseconds(random.corner(0, 65_535) as u16),
            enable: Milliseconds(random.corner(0, 200) as u16),
        }),
    }
}

/// Returns the highest rate that these drivers and the build allow, Q8 full steps/s.
fn max_rate(drivers: &Drivers, microsteps: u8) -> i64 {
    let pulses = match drivers {
        Drivers::StepDir(times) | Drivers::Tmc2209(Tmc2209 { times, .. }) => {
            DriverTiming::new(times).map_or(1, |timing| timing.max_pulse_rate())
        }
        Drivers::Coils(_) => MAX_COIL_RATE * u32::from(microsteps),
        Drivers::MotorHats(_) => MAX_HAT_RATE * u32::from(microsteps),
    };
    (i64::from(pulses.min(build(true).max_pulse_rate)) << 8) / i64::from(microsteps)
}

fn motor(random: &mut Random, max_rate: i64) -> Motor {
    let travel = |random: &mut Random| match random.below(8) {
        0 => 0,
        1 => random.range(0, 200),
        2..=4 => MAX_TRAVEL,
        _ => random.corner(0, MAX_TRAVEL),
    };
    let down = travel(random);
    let up = if random.percent(50) { down } else { travel(random) };
    let ordinary = random.percent(60);
    let (rate, acceleration) = if ordinary {
        (random.range(1, max_rate.min(2000 << 8)), random.range(200, 100_000))
    } else {
        (random.corner(1, max_rate), random.corner(40, 4_000_000))
    };
    Motor {
        max_rate: Rate(rate as i32),
        max_acceleration: Acceleration(acceleration as u32),
        travel_min: Steps16(-down as i32),
        travel_max: Steps16(up as i32),
        reversed: random.percent(50),
    }
}

fn law(random: &mut Random, count: usize) -> Law {
    match random.below(5) {
        0 => Law::Interval(interval(random, count)),
        1 => Law::Sign(Sign { gain: SignGain(random.corner(1, 1 << 20) as u32) }),
        2 => Law::Adaptive(Estimated { delay: Milliseconds(random.corner(0, 500) as u16) }),
        3 => taut(count, random.corner(0, 500) as u16),
        _ => typical_law(random, count),
    }
}

/// Returns a family in which each motor moves the ball: the first row that the motors reach has no
/// zero.
fn interval(random: &mut Random, count: usize) -> Interval {
    let gain = Gain(random.corner(1, 16 << 16) as u32);
    let mut law = family(count, Bound(1), Bound(8 << 16), gain);
    for row in 0..3 {
        for column in 0..count {
            if row > first_row(count) && random.percent(20) {
                law.signs[row][column] = random.range(-1, 1) as i8;
            }
            let alpha = random.corner(1, MAX_BOUND);
            law.alpha[row][column] = Bound(alpha as u32);
            law.beta[row][column] = Bound(random.corner(alpha, MAX_BOUND) as u32);
        }
    }
    law
}

/// Returns the first row of a law's matrices that as many motors reach: that of x, or of y.
fn first_row(count: usize) -> usize {
    usize::from(count < MOTORS)
}

fn workspace(random: &mut Random) -> Workspace {
    let mut workspace = Workspace {
        min: Point([Micrometres(-MAX_COORDINATE as i32); 3]),
        max: Point([Micrometres(MAX_COORDINATE as i32); 3]),
    };
    // In half of the cases the largest workspace.
    if random.percent(50) {
        for axis in 0..3 {
            let low = random.corner(-MAX_COORDINATE, MAX_COORDINATE - 1);
            let high = random.corner(low + 1, MAX_COORDINATE);
            workspace.min.0[axis] = Micrometres(low as i32);
            workspace.max.0[axis] = Micrometres(high as i32);
        }
    }
    workspace
}

/// Returns deadlines with the maximum age below the position deadline, which is at least 2 ms.
fn deadlines(random: &mut Random) -> Deadlines {
    let position = random.corner(2, MAX_DEADLINE);
    Deadlines {
        host: Milliseconds(random.corner(1, MAX_DEADLINE) as u16),
        position: Milliseconds(position as u16),
        max_age: Milliseconds(random.corner(1, position - 1) as u16),
    }
}

fn growth(random: &mut Random) -> Growth {
    Growth { margin: margin(random), time: Milliseconds(random.corner(1, 5_000) as u16) }
}

/// Returns the margin of a guard, mostly the largest.
fn margin(random: &mut Random) -> Micrometres {
    let largest = random.percent(60);
    Micrometres(if largest { 1_000_000 } else { random.corner(1, 1_000_000) as i32 })
}

/// Returns the limit of the motors' turn without the ball, mostly the farthest.
fn following(random: &mut Random) -> Following {
    let turn = if random.percent(60) { 1_600_000 } else { random.corner(1, 1_600_000) as i32 };
    let movement = Micrometres(random.corner(5_000, 1_000_000) as i32);
    Following { turn: Steps16(turn), movement }
}

/// Returns the limit of the time without progress, mostly the longest.
fn progress(random: &mut Random) -> Progress {
    let time = if random.percent(60) { 60_000 } else { random.corner(1, 60_000) as u16 };
    Progress { margin: margin(random), time: Milliseconds(time) }
}

/// Returns limits of a reference, up to what a board accepts.
fn path_limits(random: &mut Random) -> PathLimits {
    PathLimits {
        speed: Speed(random.corner(1, 2_000_000) as i32),
        acceleration: PathAcceleration(random.corner(1, 20_000) as u16),
        jerk: PathJerk(random.corner(1, 1_000_000) as u32),
        deviation: Micrometres(random.corner(1, 1_000_000) as i32),
    }
}

/// Returns limits of jogs, in half of the cases the widest.
fn jog_limits(random: &mut Random) -> JogLimits {
    let wide = random.percent(50);
    let most = |wide, random: &mut Random| if wide { 1 << 30 } else { random.corner(1, 1 << 30) };
    JogLimits {
        max_rate: Rate(most(wide, random) as i32),
        max_distance: Steps16(most(wide, random) as i32),
    }
}

/// Returns a wiring and a configuration with a value that is usually out of range.
pub fn invalid(random: &mut Random, positions: [i32; 3]) -> Stored {
    let Stored { mut wiring, mut config } = accepted(random, positions);
    let count = config.motors.len();
    let motor = random.below(3) as usize % count;
    match random.below(28) {
        0 => config.motors[motor].max_rate = Rate(random.any_i32()),
        1 => config.motors[motor].max_acceleration = Acceleration(random.any_i32() as u32),
        2 => config.motors[motor].travel_min = Steps16(random.any_i32()),
        3 => config.motors[motor].travel_max = Steps16(random.any_i32()),
        4 => config.microsteps = random.bits() as u8,
        5 => config.workspace.max = any_point(random),
        6 => config.reached.radius = Micrometres(random.any_i32()),
        7 => config.reached.frames = 0,
        8 => config.deadlines.host = Milliseconds(random.pick(&[0, 5001, u16::MAX])),
        // The position deadline is below the maximum age.
        9 => config.deadlines.max_age = Milliseconds(random.corner(1, MAX_DEADLINE) as u16),
        10 => config.growth.time = Milliseconds(random.pick(&[0, 5_001, u16::MAX])),
        18 => config.following.movement = Micrometres(random.pick(&[0, 4_999, 1_000_001])),
        19 => config.progress.time = Milliseconds(random.pick(&[0, 60_001, u16::MAX])),
        11 => wiring.drivers = Drivers::Coils(Coils { duty_percent: random.pick(&[0, 101, 255]) }),
        21 => wiring.pins.emergency.number = random.below(40) as u8,
        22 => wiring.pins.motors[motor].step.number = random.bits() as u8,
        12 => config.mean = Milliseconds(random.range(401, 65_535) as u16),
        13 => config.law = taut(count, random.range(501, 65_535) as u16),
        20 => config.path.speed = Speed(random.pick(&[0, -1, 2_000_001])),
        17 => config.jog.max_rate = Rate(-(random.below(2) as i32)),
        14..=16 => config.law = invalid_interval(random, count),
        24 => miscount(random, &mut wiring, &mut config),
        25 => config.law = uneven_interval(random, count),
        26 => {
            config.motors = config.motors.up_to(LEAST_MOTORS);
            wiring = wiring.of_motors(LEAST_MOTORS);
            config.law = taut(MOTORS, 5);
        }
        27 => {
            // Two motors get a width, and three none.
            let width = if count < MOTORS { random.corner(1, MAX_COORDINATE) as i32 } else { 0 };
            let side = random.pick(&[1, -1]) * width;
            config.workspace.min.0[0] = Micrometres(side.min(0));
            config.workspace.max.0[0] = Micrometres(side.max(0));
        }
        _ => config.motors[motor] = narrowed(config.motors[motor], positions[motor]),
    }
    Stored { wiring, config }
}

/// Gives the wiring and the configuration different numbers of motors, or both a wrong one.
fn miscount(random: &mut Random, wiring: &mut Wiring, config: &mut Config) {
    let (count, first) = (config.motors.len(), config.motors[0]);
    match random.below(4) {
        0 if count > LEAST_MOTORS => *wiring = wiring.of_motors(LEAST_MOTORS),
        0 => config.motors = MotorList::from_fn(MOTORS, |_| first),
        1 => *wiring = wiring.of_motors(1),
        2 => config.motors = MotorList::from_fn(MOTORS + 1, |_| first),
        _ => {
            *wiring = wiring.of_motors(1);
            config.motors = config.motors.up_to(1);
        }
    }
}

/// Returns a family one of whose rows has an entry more or fewer.
fn uneven_interval(random: &mut Random, count: usize) -> Law {
    let mut law = interval(random, count);
    let (row, length) = (random.below(3) as usize, random.pick(&[count - 1, count + 1]));
    match random.below(3) {
        0 => law.signs[row] = MotorList::from_fn(length, |k| i8::from(k % 2 == 0)),
        1 => law.alpha[row] = MotorList::from_fn(length, |_| Bound(1)),
        _ => law.beta[row] = MotorList::from_fn(length, |_| Bound(1 << 16)),
    }
    Law::Interval(law)
}

fn invalid_interval(random: &mut Random, count: usize) -> Law {
    let mut law = interval(random, count);
    match random.below(4) {
        0 => law.signs[0][0] = 2,
        1 => law.signs = [MotorList::from_fn(count, |_| 0); 3],
        2 => law.alpha[first_row(count)][1] = Bound(0),
        _ => law.gain = Gain(0),
    }
    Law::Interval(law)
}

/// Returns the motor with a travel that contains 0 but not `position`, unless that is 0.
fn narrowed(motor: Motor, position: i32) -> Motor {
    let end = Steps16(position / 2);
    match position {
        0 => motor,
        1.. => Motor { travel_max: end, ..motor },
        _ => Motor { travel_min: end, ..motor },
    }
}

/// Returns a point inside the workspace, often on its border.
pub fn point_in(random: &mut Random, workspace: &Workspace) -> Point {
    let Workspace { min, max } = workspace;
    let coordinate = |axis: usize| random.corner(min.0[axis].0.into(), max.0[axis].0.into());
    Point([0, 1, 2].map(coordinate).map(|c| Micrometres(c as i32)))
}

/// Returns a reference: mostly knots inside the workspace that move at up to 2 m/s.
pub fn reference(random: &mut Random, config: Option<Config>) -> Reference {
    let knot = |random: &mut Random| {
        let position = match config {
            Some(config) if !random.one_in(40) => point_in(random, &config.workspace),
            _ => any_point(random),
        };
        let fastest = if random.one_in(40) { 1 << 31 } else { 2_000_000 };
        let at_rest = random.one_in(4);
        let velocity = [0; 3].map(|_| {
            let speed = random.range(-fastest, fastest - 1) as i32;
            Speed(if at_rest { 0 } else { speed })
        });
        Knot { position, velocity }
    };
    let time = |random: &mut Random| match random.below(8) {
        0 => Micros(u64::MAX),
        1 => Micros(0),
        _ => Micros(1_000_000 + random.below(2_000_000)),
    };
    Reference {
        sequence: random.bits() as u16,
        now: time(random),
        waits: random.percent(50),
        first: time(random),
        interval_us: if random.one_in(20) { 0 } else { random.corner(10_000, 500_000) as u32 },
        knots: std::array::from_fn(|_| knot(random)),
    }
}

/// Returns any point.
pub fn any_point(random: &mut Random) -> Point {
    Point([0; 3].map(|_| Micrometres(random.any_i32())))
}

/// Returns a prior: one in range for the law and the motors of `config`, or any.
pub fn prior(random: &mut Random, config: &Config) -> Prior {
    let is_valid = random.percent(80);
    let motors = if is_valid { config.motors.len() } else { random.below(5) as usize };
    let is_jacobian =
        if is_valid { !matches!(config.law, Law::Taut(_)) } else { random.percent(50) };
    let mut of = |low: i64, high: i64| {
        let range = if is_valid { (low, high) } else { (i32::MIN.into(), i32::MAX.into()) };
        MotorList::from_fn(motors, |_| random.corner(range.0, range.1) as i32)
    };
    if is_jacobian {
        let entry = i64::from(JacobianPrior::MAX_ENTRY);
        let doubt = i64::from(JacobianPrior::MAX_DEVIATION);
        let mut entries = [0; 3].map(|_| of(-entry, entry));
        let mut deviations = [0; 3].map(|_| of(0, doubt).map(|sd| sd as u32));
        if is_valid && motors == LEAST_MOTORS {
            (entries[0], deviations[0]) = (entries[0].map(|_| 0), deviations[0].map(|_| 0));
        }
        return Prior::Jacobian(JacobianPrior { entries, deviations, common: random.bits() as u8 });
    }
    let cable_per_step = of(1, i32::MAX.into()).map(|nm| nm as u32);
    Prior::Rig(RigPrior {
        motors: MotorList::from_fn(motors, |_| any_point(random)),
        deviation: Micrometres(random.corner(1, 1_000_000) as i32),
        cable_per_step,
        cable_deviation: random.corner(1, u16::MAX.into()) as u16,
    })
}

/// Returns any covariance.
pub fn covariance(random: &mut Random) -> Option<Covariance> {
    match random.below(4) {
        0 => None,
        1 => Some(Covariance { variances: [0; 3], covariances: [0; 3] }),
        2 => Some(Covariance { variances: [u16::MAX; 3], covariances: [i16::MIN; 3] }),
        _ => Some(Covariance {
            variances: [0; 3].map(|_| random.bits() as u16),
            covariances: [0; 3].map(|_| random.bits() as i16),
        }),
    }
}
