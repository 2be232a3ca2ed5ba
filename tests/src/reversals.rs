//! Drives whose target is replaced on the way by one in the opposite direction: how they end on
//! rigs with right and with wrong wiring.

mod places;
mod plain_rule;

use std::time::Duration;

use nalgebra::Point3;
use plumb_emulator::plant::{CameraMonitor, Elastic, ElasticParameters, Plant, QuasiStatic};
use plumb_protocol::config::Config;
use plumb_protocol::message::{Command, Fault, Knot, Reference, State};
use plumb_protocol::units::{Micros, Point, Speed};
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::bench::{Bench, RATE_HZ, bench, wide_rig};
use crate::links::link;
use crate::plants::Miswired;
use places::Places;
use plain_rule::PlainRule;

pub use places::RigKind;

/// Longest run, frames.
const MOST_FRAMES: u32 = 30 * RATE_HZ as u32;
/// Frames in which reversals that come often end, so that the ball can reach the last target.
const OFTEN_FRAMES: u32 = 10 * RATE_HZ as u32;
/// Gain of law `interval`, 1/s.
const GAMMA: f64 = 200.0;
/// Speed of a path, m/s.
const PATH_SPEED: f64 = 0.2;
/// Frame in which a path begins.
const PATH_FRAME: u32 = 5;
/// Time between two knots of a path, µs.
const KNOT_US: u32 = 100_000;

/// Wiring of the motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wiring {
    /// Index of the board's motor that turns pulley A, B, C.
    pub order: [usize; 3],
    /// +1, or -1 for a reversed motor, for pulley A, B, C.
    pub signs: [f64; 3],
}

impl Wiring {
    /// The right one.
    pub const RIGHT: Self = Self { order: [0, 1, 2], signs: [1.0; 3] };

    /// Returns every exchange of two or three motors, and every reversal.
    pub fn wrong() -> impl Iterator<Item = Self> {
        let orders = [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]]
            .map(|order| Self { order, ..Self::RIGHT });
        let reversals = (1..8).map(|bits| Self {
            signs: [0, 1, 2].map(|i| if bits >> i & 1 == 1 { -1.0 } else { 1.0 }),
            ..Self::RIGHT
        });
        orders.into_iter().chain(reversals)
    }
}

/// When the target is replaced by the opposite one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reversals {
    /// Never.
    Never,
    /// Once, at this frame of the first move.
    Once(u32),
    /// Once, at this frame of a path to the first target.
    OnceOnPath(u32),
    /// Once, at this frame of the first move, two frames after a Stop.
    OnceAfterStop(u32),
    /// For ten seconds, each a random number of frames after the last one: at least the first, and
    /// below the second.
    Often(u32, u32),
}

/// A run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReversalRun {
    /// Rig.
    pub rig: RigKind,
    /// Law.
    pub law: LawName,
    /// Wiring.
    pub wiring: Wiring,
    /// Reversals of the target.
    pub reversals: Reversals,
    /// Seed of the places, the rig, the camera's errors and the moments.
    pub seed: u64,
}

/// End of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The ball is held at the last target.
    Held,
    /// The board has stopped by itself.
    Stopped(Fault),
    /// The simulated rig could not follow its motors.
    RigFailed,
    /// None of these within half a minute.
    Unfinished,
}

/// How a run ended, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The end.
    pub end: End,
    /// Time from the first target to the end, s.
    pub after_s: f64,
    /// Time after which the divergence guard without run-outs would have stopped the drive, s.
    pub plain_s: Option<f64>,
    /// Time of the first reversal, s.
    pub reversed_s: Option<f64>,
    /// Farthest that the ball was from the start, m.
    pub ball_m: f64,
}

impl Outcome {
    /// Returns whether the board has stopped for an error that grows.
    pub fn is_growing(&self) -> bool {
        self.end == End::Stopped(Fault::ErrorGrowing)
    }

    /// Returns whether the drive has ended without the ball at its target.
    pub fn is_stopped(&self) -> bool {
        matches!(self.end, End::Stopped(_) | End::RigFailed)
    }
}

impl ReversalRun {
    /// Executes the run.
    ///
    /// # Panics
    /// If the run cannot be prepared, or the link fails.
    pub fn execute(&self) -> Outcome {
        let rig = self.rig_file();
        let config = rig.config().expect("a rig file that fits the board");
        let places = Places::draw(self.rig, &config.workspace, self.seed);
        let wire = (link("1 ms").wire)(self.seed);
        let bench = bench(&rig, self.plant(&places), wire).expect("a board");
        Execution::new(*self, bench, places, config).run()
    }

    /// Returns the rig file of the run, with the guard of the paper's.
    fn rig_file(&self) -> Rig {
        let paper = Rig::paper().expect("the paper's rig file");
        let mut rig = match self.rig {
            RigKind::Random => Rig { growth: paper.growth, ..wide_rig(self.law) },
            RigKind::Paper | RigKind::Elastic => Rig { law: LawSettings::from(self.law), ..paper },
        };
        rig.law.set_gamma(GAMMA).expect("a gain");
        rig
    }

    /// Returns the simulated rig with the ball at the start.
    fn plant(&self, places: &Places) -> Box<dyn Plant + Send> {
        let (Wiring { order, signs }, Places { geometry, start, .. }) = (self.wiring, *places);
        match self.rig {
            RigKind::Elastic => {
                let plant = Elastic::new(geometry, ElasticParameters::default(), start);
                Box::new(Miswired { plant: plant.expect("a plant"), order, signs })
            }
            RigKind::Paper | RigKind::Random => {
                let plant = QuasiStatic::new(geometry, start).expect("a plant");
                Box::new(Miswired { plant, order, signs })
            }
        }
    }

    /// Returns the frames of the reversals, in order.
    fn moments(&self) -> Vec<u32> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(12);
        match self.reversals {
            Reversals::Never => vec![],
            Reversals::Once(frame)
            | Reversals::OnceOnPath(frame)
            | Reversals::OnceAfterStop(frame) => vec![frame],
            Reversals::Often(least, below) => {
                let next = |last: &u32| Some(last + random.random_range(least..below));
                let moments = std::iter::successors(Some(0), next).skip(1);
                moments.take_while(|frame| *frame < OFTEN_FRAMES).collect()
            }
        }
    }
}

/// A run under way.
struct Execution {
    run: ReversalRun,
    bench: Bench,
    places: Places,
    observer: CameraMonitor,
    plain: PlainRule,
    /// Frames of the reversals.
    moments: Vec<u32>,
    outcome: Outcome,
}

impl Execution {
    fn new(run: ReversalRun, bench: Bench, places: Places, config: Config) -> Self {
        let observer = CameraMonitor::new(Default::default(), run.seed).expect("an observer");
        let moments = run.moments();
        let reversed_s = moments.first().map(|frame| time_s(*frame));
        let outcome =
            Outcome { end: End::Unfinished, after_s: 0.0, plain_s: None, reversed_s, ball_m: 0.0 };
        Self { run, bench, places, observer, plain: PlainRule::new(config), moments, outcome }
    }

    fn run(mut self) -> Outcome {
        for frame in 0..MOST_FRAMES {
            let count = self.moments.iter().filter(|moment| **moment <= frame).count();
            let target = self.places.targets[count % 2];
            self.command(frame, count, target);
            let is_followed = self.report(frame, target);
            self.outcome.after_s = time_s(frame);
            let moved = (self.bench.ball() - self.places.start).norm();
            self.outcome.ball_m = self.outcome.ball_m.max(moved);
            self.outcome.end = match self.bench.state() {
                State::Fault(fault) => End::Stopped(fault),
                _ if !is_followed => End::RigFailed,
                State::Holding if count == self.moments.len() => End::Held,
                _ => continue,
            };
            break;
        }
        self.outcome
    }

    /// Sends the commands of `frame`, before which the target was reversed `count` times.
    fn command(&mut self, frame: u32, count: usize, target: Point3<f64>) {
        match self.run.reversals {
            Reversals::OnceOnPath(_) if count == 0 => {
                // A path begins where the board has seen the ball.
                return frame.checked_sub(PATH_FRAME).map_or((), |frame| self.follow(frame));
            }
            Reversals::OnceAfterStop(moment) if frame + 2 == moment => {
                self.bench.link.submit(Command::Stop).expect("an intact link");
            }
            _ => {}
        }
        if frame == 0 || self.moments.contains(&frame) {
            self.bench.link.request_target(point(target)).expect("an intact link");
        }
    }

    /// Sends the part of the path from the start to the first target that is next in `frame`.
    fn follow(&mut self, frame: u32) {
        let way = self.places.targets[0] - self.places.start;
        let speed = way.normalize() * PATH_SPEED;
        let end_s = way.norm() / PATH_SPEED;
        let now_us = u64::from(frame) * 1_000_000 / RATE_HZ;
        let knot = |k: usize| {
            let time_s = (now_us + k as u64 * u64::from(KNOT_US)) as f64 / 1e6;
            let velocity = if time_s < end_s { speed } else { speed * 0.0 };
            Knot {
                position: point(self.places.start + speed * time_s.min(end_s)),
                velocity: [0, 1, 2].map(|i| Speed((velocity[i] * 1e6) as i32)),
            }
        };
        let (now, knots) = (Micros(now_us), std::array::from_fn(knot));
        let reference =
            Reference { sequence: 0, now, waits: true, first: now, interval_us: KNOT_US, knots };
        self.bench.link.follow(reference).expect("an intact link");
    }

    /// Observes the ball, reports the position that has arrived, and runs the board until the next
    /// frame. Returns whether the rig could follow its motors.
    fn report(&mut self, frame: u32, target: Point3<f64>) -> bool {
        let time = time_s(frame);
        self.observer.observe(time, self.bench.ball());
        let seen = self.observer.delivered(time);
        let age_s = seen.map_or(0.0, |observation| time - observation.captured_at_s);
        let ball = seen.and_then(|observation| observation.position);
        let now = self.bench.board.borrow().now();
        let reference = self.bench.link.telemetry().and_then(|telemetry| telemetry.reference);
        let target = reference.map_or(point(target), |reference| reference.position);
        if let Some(ball) = ball
            && self.plain.update(now, point(ball), target)
        {
            self.outcome.plain_s.get_or_insert(time);
        }
        self.bench.report(ball, Duration::from_secs_f64(age_s)).is_ok()
    }
}

/// Returns the time of `frame`, s.
fn time_s(frame: u32) -> f64 {
    f64::from(frame) / RATE_HZ as f64
}

/// Returns `place`, m, in the wire's unit.
fn point(place: Point3<f64>) -> Point {
    Point::from_metres(place.into()).expect("a place in the wire's range")
}
