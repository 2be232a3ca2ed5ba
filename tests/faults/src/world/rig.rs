//! The paper's rig, with its faults.

use nalgebra::{Point3, Rotation3, Vector3};
use plumb_emulator::plant::{Plant, QuasiStatic, RigError, Task};
use plumb_protocol::units::Micros;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::kind::Kind;
use crate::plan::{Fault, Plan};

/// Time between two solutions for the ball's place, s: the ball moves less than 1 mm in it.
const PERIOD_S: f64 = 0.002;
/// Cable that a torn one pays out, full steps: beyond the size of the rig.
const TORN_STEPS: f64 = 10_000.0;
/// Time in which it does, s.
const TEAR_S: f64 = 0.3;
/// Time between two draws of lost steps, s.
const LOSS_S: f64 = 0.02;

/// Rig whose motors stall where rigid cables would be pulled flat.
pub(super) struct FaultyRig {
    plant: QuasiStatic,
    faults: Vec<Fault>,
    random: ChaCha8Rng,
    time_s: f64,
    /// Time since the last solution, s.
    waited_s: f64,
    /// Motor positions of the board at the last tick, full steps.
    motors: [f64; 3],
    /// Positions of the pulleys, full steps.
    pulleys: [f64; 3],
    /// Pulleys at the last solution.
    solved: [f64; 3],
    /// Whether the steps of the present draw are lost, and the end of the draw, s.
    loss: (bool, f64),
    /// Place of the ball when it was caught, m.
    caught: Option<Point3<f64>>,
}

impl FaultyRig {
    /// Returns the rig of a plan.
    pub(super) fn new(plan: &Plan) -> Self {
        let Task { geometry, start, .. } = plan.task();
        let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
        random.set_stream(4);
        Self {
            plant: QuasiStatic::new(geometry, start).expect("the paper's rig"),
            faults: plan.faults.clone(),
            random,
            time_s: 0.0,
            waited_s: 0.0,
            motors: [0.0; 3],
            pulleys: [0.0; 3],
            solved: [0.0; 3],
            loss: (false, 0.0),
            caught: None,
        }
    }

    fn now(&self) -> Micros {
        Micros((self.time_s * 1e6).round() as u64)
    }

    /// Returns the turns of the pulleys for those of the motors in a tick of `dt_s`, full steps.
    fn turned(&mut self, mut turns: [f64; 3], dt_s: f64) -> [f64; 3] {
        let (now, count) = (self.now(), self.plant.geometry().count());
        for index in 0..self.faults.len() {
            let fault = self.faults[index];
            if !fault.acts(now) {
                continue;
            }
            let turn = &mut turns[fault.motor];
            match fault.kind {
                Kind::ReversedMotor => *turn = -*turn,
                Kind::SwappedMotors => turns.swap(fault.motor, (fault.motor + 1) % count),
                Kind::WrongSigns => turns[..count].rotate_left(1),
                Kind::WrongDrum => *turn *= drum(&fault),
                Kind::SlippingPulley => *turn *= fault.between(0.9, 0.0),
                Kind::StuckMotor => *turn = 0.0,
                Kind::LostSteps if self.loses(&fault) => *turn = 0.0,
                Kind::CutCable => *turn += torn(&fault, self.time_s, dt_s),
                _ => {}
            }
        }
        turns
    }

    /// Draws whether the present steps are lost.
    fn loses(&mut self, fault: &Fault) -> bool {
        if self.time_s >= self.loss.1 {
            let is_lost = self.random.random::<f64>() < fault.between(0.05, 0.6);
            self.loss = (is_lost, self.time_s + LOSS_S);
        }
        self.loss.0
    }
}

/// Returns the drum's radius over that of the others: 0.1 to 0.3, or 3 to 10.
fn drum(fault: &Fault) -> f64 {
    if fault.strength < 0.5 {
        0.1 + 0.4 * fault.strength
    } else {
        3.0 + 14.0 * (fault.strength - 0.5)
    }
}

/// Returns the cable that a torn one pays out in the tick that ends at `time_s`, full steps.
fn torn(fault: &Fault, time_s: f64, dt_s: f64) -> f64 {
    let since = time_s - fault.from.0 as f64 * 1e-6;
    if since < TEAR_S { TORN_STEPS * dt_s / TEAR_S } else { 0.0 }
}

/// Returns how a hand displaces the ball: up by 0.05 m to 0.3 m, or aside to and fro by 0.05 m to
/// 0.2 m; m.
fn hand(fault: &Fault, time_s: f64) -> Vector3<f64> {
    let [from, to] = [fault.from, fault.to].map(|time| time.0 as f64 * 1e-6);
    let share = (time_s - from) / (to - from);
    let wave = |turns: f64| (share * turns * std::f64::consts::TAU).sin();
    match fault.kind {
        Kind::LiftedBall => Vector3::z() * fault.between(0.05, 0.3) * wave(0.5),
        Kind::PushedBall => {
            let direction = Rotation3::from_axis_angle(&Vector3::z_axis(), fault.motor as f64);
            direction * Vector3::x() * fault.between(0.05, 0.2) * wave(2.0)
        }
        _ => Vector3::zeros(),
    }
}

impl Plant for FaultyRig {
    fn advance(&mut self, dt_s: f64, motors: [f64; 3]) -> Result<(), RigError> {
        self.time_s += dt_s;
        self.waited_s += dt_s;
        let turns = [0, 1, 2].map(|i| motors[i] - self.motors[i]);
        self.motors = motors;
        let turned = self.turned(turns, dt_s);
        self.pulleys = [0, 1, 2].map(|i| self.pulleys[i] + turned[i]);
        let now = self.now();
        let is_caught = |fault: &Fault| fault.kind == Kind::CaughtBall && fault.acts(now);
        if self.caught.is_none() && self.faults.iter().any(is_caught) {
            self.caught = Some(self.plant.ball());
        }
        if self.waited_s >= PERIOD_S && self.pulleys != self.solved {
            // An error leaves the ball where it was: the motors stall.
            let _ = self.plant.advance(self.waited_s, self.pulleys);
            (self.waited_s, self.solved) = (0.0, self.pulleys);
        }
        Ok(())
    }

    fn ball(&self) -> Point3<f64> {
        let now = self.now();
        let acting = self.faults.iter().filter(|fault| fault.acts(now));
        let displaced: Vector3<f64> = acting.map(|fault| hand(fault, self.time_s)).sum();
        self.caught.unwrap_or(self.plant.ball()) + displaced
    }

    fn slack(&self) -> [bool; 3] {
        self.plant.slack()
    }
}
