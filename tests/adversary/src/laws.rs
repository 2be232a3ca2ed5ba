//! The control laws with extreme input.

use plumb_core::MotorRates;
use plumb_core::law::{
    DeferredLaw, DeferredLawKind, Law, LawSelection, Measurement, Setpoint, variances,
};
use plumb_core::params::Params;
use plumb_protocol::wiring::{Drivers, StepDir};
use plumb_protocol::{Config, MOTORS};

use crate::campaign::Outcome;
use crate::generate;
use crate::random::Random;

/// A law's setpoint, limited by the motors' limits, is within them.
pub const WITHIN: &str = "rates within the limits";
/// A law turns no motor that the rig has not.
pub const ABSENT: &str = "an absent motor has no rate";
/// Two copies of a law give the same setpoint, to the bit.
pub const DETERMINISTIC: &str = "a law is deterministic";
/// A law's state has no NaN.
pub const NUMBERS: &str = "a law holds numbers";
/// After the extremes and 300 ordinary measurements a law moves the motors again. Weak gains may
/// move no motor even in a new law without an estimate.
pub const RECOVERS: &str = "a law recovers";

/// Number of ordinary measurements after which a law must move the motors.
const RECOVERY_MEASUREMENTS: u64 = 300;
/// Highest |position| of a motor, 1/16 steps.
const MAX_TRAVEL: i64 = 1 << 29;
/// Highest |coordinate| of the ball, µm.
const MAX_COORDINATE: i64 = 4_000_000;

/// Motion of the motors between two measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    Rest,
    Ordinary,
    EndToEnd,
    Leaps,
    Fast,
}

impl Motion {
    const ALL: [Self; 5] = [Self::Rest, Self::Ordinary, Self::EndToEnd, Self::Leaps, Self::Fast];

    /// Returns a step of one motor, 1/16 steps.
    fn step(self, random: &mut Random) -> i64 {
        match self {
            Self::Rest => 0,
            Self::Ordinary => random.range(-16 * 40, 16 * 40),
            Self::EndToEnd => random.corner(-MAX_TRAVEL, MAX_TRAVEL),
            Self::Leaps if random.percent(5) => random.range(-(1 << 20), 1 << 20),
            Self::Leaps => random.range(-200, 200),
            Self::Fast => random.range(-(1 << 14), 1 << 14),
        }
    }

    /// Returns the steps that a motor moves until the setpoint takes effect, 1/16 steps.
    fn lead(self, random: &mut Random) -> i64 {
        match self {
            Self::EndToEnd => random.range(-MAX_TRAVEL / 4, MAX_TRAVEL / 4),
            _ => random.range(-3000, 3000),
        }
    }
}

/// Source of measurements.
struct Scene {
    motion: Motion,
    /// Whether two motors move the ball in the plane x = 0. Motor C turns all the same, as for an
    /// earlier configuration.
    is_planar: bool,
    motors: [i32; 3],
    ball: [i32; 3],
    target: [i32; 3],
}

impl Scene {
    fn new(random: &mut Random, config: &Config) -> Self {
        let motion = random.pick(&Motion::ALL);
        let (motors, is_planar) = ([0; 3], is_planar(config));
        Self { motion, is_planar, motors, ball: anywhere(random), target: anywhere(random) }
    }

    fn next(&mut self, random: &mut Random) -> Measurement {
        if random.percent(2) {
            self.target = anywhere(random);
        }
        self.ball = match random.below(6) {
            0 => anywhere(random),
            1 => self.ball,
            2 => self.target,
            _ => self.ball.map(|b| moved(b, random.range(-20_000, 20_000), MAX_COORDINATE)),
        };
        let before = self.motors;
        self.motors = self.motors.map(|m| moved(m, self.motion.step(random), MAX_TRAVEL));
        let then = self.motors;
        self.reachable(Measurement {
            ball: self.ball,
            variances: variances(generate::covariance(random)),
            motors: then,
            motors_before: [before, [0, 1, 2].map(|i| before[i] - (then[i] - before[i]) / 2)],
            motors_ahead: then.map(|m| (i64::from(m) + self.motion.lead(random)) as i32),
            target: self.target,
            velocity: [0; 3],
        })
    }

    /// Returns the measurement with what the motors reach of its places.
    fn reachable(&self, mut measurement: Measurement) -> Measurement {
        if self.is_planar {
            (measurement.ball[0], measurement.target[0]) = (0, 0);
        }
        measurement
    }

    /// Returns the measurement of a ball and motors at rest.
    fn at_rest(&self) -> Measurement {
        self.reachable(Measurement {
            ball: [540_000, 220_000, 459_000],
            variances: variances(None),
            motors: self.motors,
            motors_before: [self.motors; 2],
            motors_ahead: self.motors,
            target: [400_000, 400_000, 150_000],
            velocity: [0; 3],
        })
    }
}

fn is_planar(config: &Config) -> bool {
    config.motors.len() < MOTORS
}

fn anywhere(random: &mut Random) -> [i32; 3] {
    [0; 3].map(|_| random.corner(-MAX_COORDINATE, MAX_COORDINATE) as i32)
}

fn moved(from: i32, by: i64, most: i64) -> i32 {
    (i64::from(from) + by).clamp(-most, most) as i32
}

/// Runs the laws of one seed with `measurements` extreme measurements, then with ordinary ones.
pub fn run(seed: u64, measurements: u64, outcome: &mut Outcome) {
    let mut random = Random::new(seed);
    let config = generate::accepted(&mut random, [0; 3]).config;
    run_deferred(&mut random, &config, measurements, outcome);
    run_inline(&mut random, &config, measurements, outcome);
}

/// Runs one of the laws that estimate, as [`run`]. An input of `random` that is used up ends the
/// extreme measurements.
pub fn run_deferred(
    random: &mut Random,
    config: &Config,
    measurements: u64,
    outcome: &mut Outcome,
) {
    let limits = params(config).limits();
    let kind = match random.pick(&[DeferredLawKind::Adaptive, DeferredLawKind::Taut]) {
        DeferredLawKind::Taut if is_planar(config) => DeferredLawKind::Adaptive,
        kind => kind,
    };
    outcome.tally.add("laws in a plane", is_planar(config).into());
    outcome.tally.count(if kind == DeferredLawKind::Adaptive {
        "law adaptive"
    } else {
        "law taut"
    });
    let prior = random.percent(50).then(|| generate::prior(random, config));
    let prior = prior.filter(|prior| prior.is_valid(config.motors.len()));
    let law = DeferredLaw::new(kind, limits, prior.as_ref(), &mut None);
    let (mut law, scene) = drive(random, law, config, measurements, outcome);
    let moves = moves_at_rest(&mut law, &scene);
    outcome.tally.add("recovered", moves.into());
    outcome.check(moves, RECOVERS, || format!("{:?}, limits {:?}", scene.motion, config.motors));
}

/// Runs the law of `config`, as [`run_deferred`], if it is one without an estimate.
pub fn run_inline(random: &mut Random, config: &Config, measurements: u64, outcome: &mut Outcome) {
    if let LawSelection::Inline(law) = params(config).law() {
        outcome.tally.count("law quick");
        let (mut used, scene) = drive(random, law, config, measurements, outcome);
        let (mut new, moves) = (law, moves_at_rest(&mut used, &scene));
        outcome.tally.add("recovered", moves.into());
        outcome.check(moves || !moves_at_rest(&mut new, &scene), RECOVERS, || {
            format!("{:?}, {used:?}, limits {:?}", scene.motion, config.motors)
        });
    }
}

/// Returns whether the law moves a motor in some ordinary measurements.
fn moves_at_rest(law: &mut impl Law, scene: &Scene) -> bool {
    (0..RECOVERY_MEASUREMENTS).any(|_| law.update(&scene.at_rest()).rates != MotorRates::default())
}

/// Drivers that follow every rate of the build.
const DRIVERS: Drivers = Drivers::StepDir(StepDir::TMC2209);

fn params(config: &Config) -> Params {
    match Params::check(config, &DRIVERS, &generate::build(true)) {
        Ok(params) => params,
        Err(field) => unreachable!("the configuration is within its ranges: {field}"),
    }
}

/// Updates a law with extreme measurements. Returns it with the scene after them.
fn drive<L>(
    random: &mut Random,
    mut law: L,
    config: &Config,
    measurements: u64,
    outcome: &mut Outcome,
) -> (L, Scene)
where
    L: Law + Clone + PartialEq + std::fmt::Debug,
{
    let mut scene = Scene::new(random, config);
    let mut copy = law.clone();
    for tick in 0..measurements {
        if tick > 0 && random.is_exhausted() {
            break;
        }
        outcome.tick = tick;
        outcome.tally.count("measurements");
        let measurement = scene.next(random);
        let setpoint = law.update(&measurement);
        let same = setpoint == copy.update(&measurement);
        outcome.check(same, DETERMINISTIC, || format!("{setpoint:?} at {measurement:?}"));
        check_setpoint(random, setpoint, config, outcome);
    }
    let state = format!("{law:?}");
    outcome.check(!state.contains("NaN"), NUMBERS, || format!("{:?}: {state}", scene.motion));
    (law, scene)
}

fn check_setpoint(random: &mut Random, setpoint: Setpoint, config: &Config, outcome: &mut Outcome) {
    let limits = config.motors.map(|motor| motor.max_rate.0).steppable(1);
    let still = !is_planar(config) || setpoint.rates.0[2] == 0;
    outcome.check(still, ABSENT, || format!("{setpoint:?}"));
    let MotorRates(rates) = setpoint.rates.within(limits);
    let within = (0..3).all(|i| rates[i].unsigned_abs() <= limits[i].unsigned_abs());
    outcome.check(within, WITHIN, || format!("{rates:?} of {setpoint:?}, limits {limits:?}"));
    outcome.tally.add("setpoints with motion", (rates != [0; 3]).into());
    // Neither panics, for any setpoint.
    let later = setpoint.after(random.bits());
    let MotorRates(coasting) = later.rates.within(limits).coasting();
    let slower = (0..3).all(|i| coasting[i].unsigned_abs() <= limits[i].unsigned_abs());
    outcome.check(slower, WITHIN, || format!("coasting at {coasting:?}, limits {limits:?}"));
}
