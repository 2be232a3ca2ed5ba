//! Plans: what a seed stands for.

use nalgebra::Point3;
use plumb_core::TICK_US;
use plumb_emulator::plant::Task;
use plumb_emulator::tmc2209::Trouble;
use plumb_path::trajectory::{MotionLimits, Run, Trajectory, Waypoints};
use plumb_protocol::dimension::LEAST_MOTORS;
use plumb_protocol::message::{self, DriverFault};
use plumb_protocol::units::{Micros, Point};
use plumb_runtime::rig::quantity::Current;
use plumb_runtime::rig::{Driver, LawName, LawSettings, Rig, UartSettings};
use plumb_runtime::run::PathPlan;
use plumb_tests::planar::{planar_rig, planar_task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::cause::Cause;
use crate::kind::{KINDS, Kind, Span};

/// Instant of a fault, µs: the ball is on its way to the first targets.
const ONSET_US: std::ops::Range<u64> = 200_000..5_000_000;
/// Instant of a fault in a short run, µs.
const SHORT_ONSET_US: std::ops::Range<u64> = 200_000..1_500_000;
/// Longest fault that passes in a short run, µs.
const SHORT_FAULT_US: u64 = 800_000;
/// Time for which the contact of the emergency input bounces, µs.
const BOUNCE_US: u64 = 5_000;
/// Share of the runs with two faults.
const TWO_FAULTS: f64 = 0.2;
/// Number of times that a storm kills the host.
const STORM: usize = 8;
/// Number of targets, which are driven to again and again.
const TARGETS: usize = 4;
/// Smallest distance between one target and the next, m.
const APART_M: f64 = 0.12;
/// Share of the runs along a path.
const PATHS: f64 = 1.0 / 3.0;
/// Speed of a path, m/s.
const PATH_SPEED: std::ops::Range<f64> = 0.03..0.1;
/// Half of the side of a path on which the ball is at the start, as a share of the way to the first
/// target.
const FIRST_SIDE: f64 = 0.2;
/// Largest distance of a path from a corner, m.
const CORNER_M: f64 = 0.02;
/// Current of a motor with a driver on a UART, A.
const RUN_CURRENT: Current = Current::constant(0.8);
/// Faults of motor drivers that can be asked. The campaign's emulated chip has no such drivers.
const DRIVERS: [Kind; 2] = [Kind::DriverBus, Kind::DriverUart];
/// Gain of law `interval`, 1/s. The paper's, 30, takes minutes for some of the targets.
const GAMMA: f64 = 200.0;

/// A fault of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// Kind.
    pub kind: Kind,
    /// First instant on the board's clock.
    pub from: Micros,
    /// Last instant; [`u64::MAX`] for a fault that lasts.
    pub to: Micros,
    /// Size within the range of the kind, 0 to 1.
    pub strength: f64,
    /// Index of a motor.
    pub motor: usize,
    /// Seed of its random numbers.
    pub seed: u64,
}

impl Fault {
    /// Returns whether the fault acts at `now`.
    pub fn acts(&self, now: Micros) -> bool {
        self.from <= now && now < self.to
    }

    /// Returns whether the fault holds the emergency input open in the tick at `now`. The contact
    /// bounces when it opens and when it closes: each tick of `BOUNCE_US` is open or closed at
    /// random. Bounces shorter than a tick are those of `make bounce`.
    pub fn opens_emergency(&self, now: Micros) -> bool {
        let bounces = |since: Micros| now.0.wrapping_sub(since.0) < BOUNCE_US;
        if self.kind != Kind::Emergency || now < self.from {
            return false;
        }
        let tick = now.0 / u64::from(TICK_US);
        let is_first = tick == self.from.0.div_ceil(u64::from(TICK_US));
        if !is_first && (bounces(self.from) || bounces(self.to)) {
            let mut random = ChaCha8Rng::seed_from_u64(self.seed);
            random.set_stream(tick);
            return random.random();
        }
        self.acts(now)
    }

    /// Returns whether a cause that is told describes the fault truly.
    pub fn explains(&self, cause: Cause) -> bool {
        let told = match self.driver_trouble() {
            None => return self.kind.traits().causes.iter().any(|own| own.is_like(cause)),
            Some(Trouble::Hot | Trouble::OpenCoil) => return false,
            Some(Trouble::Overtemperature) => DriverFault::Overtemperature,
            Some(Trouble::Short) => DriverFault::Short,
            Some(Trouble::Undervoltage) => DriverFault::Undervoltage,
            Some(Trouble::Reset) => DriverFault::Reset,
            Some(Trouble::Silent) => DriverFault::Silent,
        };
        cause == Cause::Board(message::Fault::Driver(told(self.motor as u8)))
    }

    /// Returns the trouble of a motor's driver on a UART; `None` of other kinds of faults.
    pub fn driver_trouble(&self) -> Option<Trouble> {
        let troubles = Trouble::ALL;
        let index = (self.seed % troubles.len() as u64) as usize;
        (self.kind == Kind::DriverUart).then(|| troubles[index])
    }

    /// Returns whether the fault ends by itself.
    pub fn passes(&self) -> bool {
        self.to.0 != u64::MAX
    }

    /// Returns the value for its strength in a range.
    pub fn between(&self, low: f64, high: f64) -> f64 {
        low + self.strength * (high - low)
    }
}

/// Life of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Life {
    /// Start.
    pub from: Micros,
    /// Instant at which the host is killed; `None` for the last life.
    pub to: Option<Micros>,
}

/// Task of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// The targets, one after the other, again and again.
    Targets,
    /// A loop through the targets, from where the ball is at the start.
    Path {
        /// Speed, m/s.
        speed: f64,
        /// Whether the path waits for the ball.
        waits: bool,
    },
}

impl Goal {
    /// Returns whether the run is along a path that waits for the ball.
    pub fn waits(&self) -> bool {
        matches!(self, Self::Path { waits: true, .. })
    }
}

/// Everything that a seed decides.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The seed.
    pub seed: u64,
    /// The faults, one or two; the first names the row of the table.
    pub faults: Vec<Fault>,
    /// Control law.
    pub law: LawName,
    /// Task.
    pub goal: Goal,
    /// Targets, m.
    pub targets: Vec<Point3<f64>>,
    /// Whether the run is short: for a board that is slow to emulate.
    pub is_short: bool,
    /// Whether the rig has two motors, and its ball moves in the plane x = 0.
    pub is_planar: bool,
}

impl Plan {
    /// Draws the plan of `seed`. Consecutive seeds go through all kinds.
    pub fn draw(seed: u64) -> Self {
        let kind = KINDS[(seed % KINDS.len() as u64) as usize].kind;
        Self::draw_with(seed, kind, TWO_FAULTS)
    }

    /// Draws the plan of `seed` with a fault of `kind` and no other.
    pub fn draw_single(seed: u64, kind: Kind) -> Self {
        Self::draw_with(seed, kind, 0.0)
    }

    fn draw_with(seed: u64, kind: Kind, two: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let law = LawName::ALL[random.random_range(0..LawName::ALL.len())];
        let mut faults = vec![draw_fault(kind, &mut random)];
        if random.random::<f64>() < two {
            let second = KINDS[random.random_range(0..KINDS.len())].kind;
            // A board has drivers of one kind.
            if second != kind && !(DRIVERS.contains(&second) && DRIVERS.contains(&kind)) {
                faults.push(draw_fault(second, &mut random));
            }
        }
        let targets = draw_targets(&mut random, false);
        let goal = draw_goal(seed);
        Self { seed, faults, law, goal, targets, is_short: false, is_planar: false }
    }

    /// Draws the plan of `seed` for two motors: the same faults, of motor A or B.
    pub fn draw_planar(seed: u64) -> Self {
        let mut plan = Self::draw(seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(8);
        plan.faults.iter_mut().for_each(|fault| fault.motor %= LEAST_MOTORS);
        if plan.law == LawName::Taut {
            plan.law = LawName::Adaptive;
        }
        Self { targets: draw_targets(&mut random, true), is_planar: true, ..plan }
    }

    /// Returns the rig without its faults, and where the ball hangs at first.
    pub fn task(&self) -> Task {
        if self.is_planar { planar_task() } else { Task::paper() }
    }

    /// Draws the short plan of `seed`, for the emulated chip: one fault, early and of at most
    /// 0.8 s, or one that lasts. Motor drivers have none.
    pub fn draw_short(seed: u64) -> Self {
        let kinds = KINDS.iter().map(|traits| traits.kind);
        let kinds: Vec<Kind> = kinds.filter(|kind| !DRIVERS.contains(kind)).collect();
        let kind = kinds[(seed % kinds.len() as u64) as usize];
        let mut plan = Self::draw_with(seed, kind, 0.0);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(6);
        for fault in plan.faults.iter_mut().filter(|fault| fault.from > Micros(0)) {
            let length = fault.to.since(fault.from).min(SHORT_FAULT_US);
            fault.from = Micros(random.random_range(SHORT_ONSET_US));
            if fault.passes() {
                fault.to = Micros(fault.from.0 + length);
            }
        }
        Self { is_short: true, ..plan }
    }

    /// Returns the first instant of any fault.
    pub fn onset(&self) -> Micros {
        self.faults.iter().map(|fault| fault.from).min().unwrap_or(Micros(0))
    }

    /// Returns the instant at which all faults have passed or act.
    pub fn settled(&self) -> Micros {
        let settled = |fault: &Fault| if fault.passes() { fault.to } else { fault.from };
        self.faults.iter().map(settled).max().unwrap_or(Micros(0))
    }

    /// Returns the lives of the host, in order: each ends where the host is killed.
    pub fn lives(&self) -> Vec<Life> {
        let mut kills: Vec<(Micros, Micros)> = self.faults.iter().flat_map(kills).collect();
        kills.sort_unstable();
        let mut from = Micros(0);
        let mut lives = Vec::new();
        for (killed, next) in kills {
            lives.push(Life { from, to: Some(killed) });
            from = next;
        }
        lives.push(Life { from, to: None });
        lives
    }

    /// Returns whether `ball`, m, is in the workspace.
    pub fn contains(&self, ball: Point3<f64>) -> bool {
        let config = self.rig().config().expect("a rig file that fits the board");
        Point::from_metres(ball.into()).is_some_and(|ball| config.workspace.contains(ball))
    }

    /// Returns the path of the run; `None` for one to targets.
    pub fn path(&self) -> Option<PathPlan> {
        let Goal::Path { speed, waits } = self.goal else { return None };
        // A loop begins in the middle of its first side.
        let start = self.task().start;
        let half = (self.targets[0] - start) * FIRST_SIDE;
        let places = [start - half, start + half].into_iter().chain(self.targets.iter().copied());
        let waypoints =
            Waypoints { places: places.collect(), speeds: Vec::new(), tolerance: CORNER_M };
        let trajectory =
            Trajectory::through(&waypoints, &MotionLimits::with_speed(speed), Run::Loop);
        let trajectory = trajectory.expect("places apart from each other");
        Some(PathPlan::new(trajectory, waits, &self.rig()).expect("a path that the rig allows"))
    }

    /// Returns the rig file of the run.
    pub fn rig(&self) -> Rig {
        let mut law = LawSettings::from(self.law);
        if self.law == LawName::Interval {
            law.set_gamma(GAMMA).expect("a gain");
        }
        let paper = || Rig { law, ..Rig::paper().expect("the paper's rig file") };
        let mut rig = if self.is_planar { planar_rig(self.law) } else { paper() };
        if self.faults.iter().any(|fault| fault.driver_trouble().is_some()) {
            rig.motors.driver = Driver::Tmc2209Uart(UartSettings::new(RUN_CURRENT));
        }
        rig
    }
}

fn draw_goal(seed: u64) -> Goal {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(7);
    if random.random::<f64>() >= PATHS {
        return Goal::Targets;
    }
    Goal::Path { speed: random.random_range(PATH_SPEED), waits: random.random() }
}

/// Returns when a fault kills the host, and when the host is started again after that.
fn kills(fault: &Fault) -> Vec<(Micros, Micros)> {
    match fault.kind {
        Kind::KilledHost => vec![(fault.from, fault.to)],
        Kind::ReconnectStorm => {
            let mut random = ChaCha8Rng::seed_from_u64(fault.seed);
            let mut at = fault.from.0;
            let mut kill = || {
                let killed = Micros(at);
                at += random.random_range(20_000..400_000);
                (killed, killed)
            };
            [(); STORM].map(|()| kill()).to_vec()
        }
        _ => Vec::new(),
    }
}

fn draw_fault(kind: Kind, random: &mut ChaCha8Rng) -> Fault {
    let instant = random.random_range(ONSET_US);
    let (from, to) = match &kind.traits().span {
        Span::Always => (0, u64::MAX),
        Span::Lasting => (instant, u64::MAX),
        Span::Passing(ms) => (instant, instant + random.random_range(ms.clone()) * 1000),
    };
    Fault {
        kind,
        from: Micros(from),
        to: Micros(to),
        strength: random.random(),
        motor: random.random_range(0..3),
        seed: random.random(),
    }
}

/// Draws targets in the middle of the workspace, each at least [`APART_M`] from the one before.
fn draw_targets(random: &mut ChaCha8Rng, is_planar: bool) -> Vec<Point3<f64>> {
    let task = if is_planar { planar_task() } else { Task::paper() };
    let mut targets = vec![task.start];
    while targets.len() <= TARGETS {
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let x = if is_planar { 0.0 } else { between(0.4, 0.65) };
        let target = Point3::new(x, between(0.2, 0.4), between(0.15, 0.45));
        let is_far = |other: &Point3<f64>| (target - other).norm() >= APART_M;
        // The first target follows the last one.
        if targets.last().is_some_and(is_far) && (targets.len() < 2 || is_far(&targets[1])) {
            targets.push(target);
        }
    }
    targets.split_off(1)
}
