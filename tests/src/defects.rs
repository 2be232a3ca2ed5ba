//! Rigs that break in mid-drive, and targets out of reach: how long until the board stops, and how
//! far ball and motors go until then.

use nalgebra::{Point3, Vector3};
use plumb_emulator::plant::{CameraMonitor, Plant, Population, QuasiStatic, RigError, Task};
use plumb_protocol::message::{Fault, State};
use plumb_protocol::units::Point;
use plumb_runtime::rig::{LawName, Rig};

use crate::bench::{Bench, RATE_HZ, bench, wide_rig};
use crate::links::link;

/// Time after the defect in which the board must notice it, s.
const NOTICE_S: f64 = 30.0;
/// Start of a defect, s: in the middle of most drives.
const ONSET_S: f64 = 0.5;
/// Cable that a torn one pays out, full steps: beyond the size of any rig.
const TORN_STEPS: f64 = 10_000.0;
/// Time in which it does, s.
const TEAR_S: f64 = 0.3;

/// Defect of a rig, or a target that it cannot reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Defect {
    /// None: the rig is healthy.
    None,
    /// Motor A stands, and its steps are counted.
    StuckMotor,
    /// Cable A is torn.
    TornCable,
    /// The ball is held where it is.
    CaughtBall,
    /// Motor A turns the wrong way.
    ReversedMotor,
    /// Motors A and B are swapped.
    SwappedMotors,
    /// The target is outside the triangle of the motors.
    TargetOutside,
}

impl Defect {
    /// Every defect.
    pub const ALL: [Self; 6] = [
        Self::StuckMotor,
        Self::TornCable,
        Self::CaughtBall,
        Self::ReversedMotor,
        Self::SwappedMotors,
        Self::TargetOutside,
    ];

    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::StuckMotor => "motor A stuck",
            Self::TornCable => "cable A torn",
            Self::CaughtBall => "ball caught",
            Self::ReversedMotor => "motor A reversed",
            Self::SwappedMotors => "motors A and B swapped",
            Self::TargetOutside => "target outside the triangle",
        }
    }

    /// Returns the time from which it acts, s; targets are out of reach from the start.
    fn onset_s(self) -> f64 {
        if self == Self::TargetOutside { 0.0 } else { ONSET_S }
    }

    /// Returns the target of `task` with this defect.
    fn target(self, task: &Task) -> Point3<f64> {
        let motors = task.geometry.motors();
        let middle =
            Point3::from(motors.iter().fold(Vector3::zeros(), |sum, m| sum + m.coords) / 3.0);
        match self {
            Self::TargetOutside => {
                let corner = middle + (motors[0] - middle) * 1.5;
                Point3::new(corner.x, corner.y, task.start.z)
            }
            _ => task.target,
        }
    }

    /// Returns the motor positions that reach the pulleys; `at_onset` are those at the onset, full
    /// steps, `since_s` the time since then.
    fn motors(self, motors: [f64; 3], at_onset: [f64; 3], since_s: f64) -> [f64; 3] {
        let ([a, b, c], [a0, b0, _]) = (motors, at_onset);
        match self {
            Self::StuckMotor => [a0, b, c],
            Self::TornCable => [a + TORN_STEPS * (since_s / TEAR_S).min(1.0), b, c],
            Self::ReversedMotor => [a0 - (a - a0), b, c],
            Self::SwappedMotors => [a0 + (b - b0), b0 + (a - a0), c],
            _ => motors,
        }
    }
}

/// A rig with a defect from a moment on.
struct Breaking {
    plant: QuasiStatic,
    defect: Defect,
    time_s: f64,
    /// Motor positions (full steps) and ball at the onset.
    onset: Option<([f64; 3], Point3<f64>)>,
}

impl Plant for Breaking {
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        self.time_s += dt_s;
        let since_s = self.time_s - self.defect.onset_s();
        if since_s < 0.0 {
            return self.plant.advance(dt_s, motors);
        }
        let (at_onset, _) = *self.onset.get_or_insert((motors, self.plant.ball()));
        self.plant.advance(dt_s, self.defect.motors(motors, at_onset, since_s))
    }

    fn ball(&self) -> Point3<f64> {
        match (self.defect, self.onset) {
            (Defect::CaughtBall, Some((_, ball))) => ball,
            _ => self.plant.ball(),
        }
    }

    fn slack(&self) -> [bool; 3] {
        self.plant.slack()
    }
}

/// A run on a random rig.
#[derive(Debug, Clone, Copy)]
pub struct DefectRun {
    /// Defect.
    pub defect: Defect,
    /// Law.
    pub law: LawName,
    /// Seed of the rig and of the camera's noise.
    pub seed: u64,
    /// Whether the guards NotFollowing and NoProgress are as lenient as a board accepts.
    pub lenient: bool,
}

/// End of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The board has stopped by itself.
    Stopped(Fault),
    /// The simulated rig could not follow its motors: three cables were pulled flat.
    RigFailed,
    /// Neither, within half a minute.
    Unnoticed,
}

/// What stopped a run, and what happened from the onset of the defect until then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// The end.
    pub end: End,
    /// Time, s.
    pub after_s: f64,
    /// Farthest that the ball was from where it was at the onset, m.
    pub ball_m: f64,
    /// Largest turn of a motor, full steps.
    pub turn: f64,
}

impl DefectRun {
    /// Runs until the board stops, at most for half a minute after the onset. At its target the
    /// ball is sent back to the start, and so on.
    ///
    /// # Panics
    /// If the run cannot be prepared, or the link fails.
    pub fn execute(&self) -> Stop {
        let task = Population::default().sample(3, self.seed).expect("a random rig");
        let plant = QuasiStatic::new(task.geometry, task.start).expect("a plant");
        let plant = Breaking { plant, defect: self.defect, time_s: 0.0, onset: None };
        let mut bench =
            bench(&self.rig(), Box::new(plant), (link("1 ms").wire)(self.seed)).expect("a board");
        let mut targets = [self.defect.target(&task), task.start].into_iter().cycle();
        seek(&mut bench, targets.next());
        let mut observer = CameraMonitor::new(Default::default(), self.seed).expect("an observer");
        let mut stop = Stop { end: End::Unnoticed, after_s: 0.0, ball_m: 0.0, turn: 0.0 };
        let mut onset = None;
        for frame in 0u32.. {
            let time = f64::from(frame) / RATE_HZ as f64;
            let measure = |ball| {
                observer.observe(time, ball);
                observer.delivered(time).and_then(|observation| observation.position)
            };
            let followed = bench.frame(measure).is_ok();
            stop.after_s = time - self.defect.onset_s();
            if stop.after_s >= 0.0 {
                let now = (bench.ball(), bench.board.borrow().motors());
                stop.note(now, *onset.get_or_insert(now));
            }
            match bench.state() {
                State::Fault(fault) => stop.end = End::Stopped(fault),
                _ if !followed => stop.end = End::RigFailed,
                State::Holding => seek(&mut bench, targets.next()),
                _ => {}
            }
            if stop.end != End::Unnoticed || stop.after_s > NOTICE_S {
                break;
            }
        }
        stop
    }

    /// Returns the rig file of the run.
    fn rig(&self) -> Rig {
        let mut rig = wide_rig(self.law);
        if self.lenient {
            rig.following.turn = 100_000.0.try_into().expect("a turn");
            rig.progress.time = 60.0.try_into().expect("a time");
        }
        rig
    }
}

impl Stop {
    /// Takes in the ball (m) and the motor positions (full steps), with those at the onset.
    fn note(&mut self, now: (Point3<f64>, [f64; 3]), onset: (Point3<f64>, [f64; 3])) {
        self.ball_m = self.ball_m.max((now.0 - onset.0).norm());
        let turns = [0, 1, 2].map(|i| (now.1[i] - onset.1[i]).abs());
        self.turn = turns.into_iter().fold(self.turn, f64::max);
    }
}

/// Sends `target` to the board.
fn seek(bench: &mut Bench, target: Option<Point3<f64>>) {
    let target = target.and_then(|target| Point::from_metres(target.into()));
    bench.link.request_target(target.expect("an endless list")).expect("an intact link");
}
