//! What the law taut has learnt of a rig, in the next run: on the same rig, and on a changed one.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use nalgebra::Point3;
use plumb_core::LawWorker;
use plumb_core::law::{DeferredLawKind, KnownRig, Measurement, variances};
use plumb_core::law_worker::{LawRequest, LawResponse};
use plumb_core::params::Params;
use plumb_emulator::EMULATED;
use plumb_emulator::plant::{Geometry, Plant, QuasiStatic, Task};
use plumb_protocol::config::{Config, Estimated, Law};
use plumb_protocol::units::{Milliseconds, RelativeTension};
use plumb_protocol::{MOTORS, PerMotor, Wiring};

/// Time between two pictures, seconds.
const FRAME_S: f64 = 0.033;
/// Distance at which the ball has arrived, metres.
const ARRIVED_M: f64 = 0.010;

/// A law worker that drives a ball without a board: rates take effect at once.
struct Rig {
    worker: LawWorker,
    plant: QuasiStatic,
    /// Motor positions since the plant's start, full steps.
    motors: PerMotor<f64>,
    /// Motor positions of the last pictures, Q4 steps, the newest first.
    past: [PerMotor<i32>; 3],
    number: u32,
    /// Number of the configuration.
    generation: u32,
}

impl Rig {
    fn new(task: &Task) -> Self {
        Self {
            worker: LawWorker::new(),
            plant: QuasiStatic::new(task.geometry, task.start).unwrap(),
            motors: [0.0; MOTORS],
            past: [[0; MOTORS]; 3],
            number: 0,
            generation: 1,
        }
    }

    /// Begins a run with a new configuration on a rig of this geometry. The ball hangs where it is.
    fn begin_run(&mut self, geometry: Geometry) {
        self.plant = QuasiStatic::new(geometry, self.plant.ball()).unwrap();
        self.motors = [0.0; MOTORS];
        self.past = [[0; MOTORS]; 3];
        self.generation += 1;
    }

    /// Updates the law by a picture, and moves the ball for the time to the next one. Returns the
    /// tensions that the law tells.
    fn step(&mut self, target: Point3<f64>) -> PerMotor<RelativeTension> {
        let micrometres = |place: Point3<f64>| [0, 1, 2].map(|i| (place[i] * 1e6) as i32);
        self.past = [self.motors.map(|steps| (steps * 16.0) as i32), self.past[0], self.past[1]];
        self.number += 1;
        let request = LawRequest {
            number: self.number,
            kind: DeferredLawKind::Taut,
            limits: params().limits(),
            generation: self.generation,
            prior: None,
            measurement: Measurement {
                ball: micrometres(self.plant.ball()),
                variances: variances(None),
                motors: self.past[0],
                motors_before: [self.past[1], self.past[2]],
                motors_ahead: self.past[0],
                target: micrometres(target),
                velocity: [0; 3],
            },
        };
        let LawResponse { setpoint, tensions, .. } = self.worker.respond(&request);
        for (motor, rate) in self.motors.iter_mut().zip(setpoint.rates.0) {
            *motor += f64::from(rate) / 256.0 * FRAME_S;
        }
        self.plant.advance(FRAME_S, self.motors).unwrap();
        tensions.unwrap()
    }

    /// Drives to `target`, and stays there for a second. Returns the pictures until the arrival.
    fn drive(&mut self, target: Point3<f64>) -> usize {
        let arrived = (0..600).find(|_| {
            self.step(target);
            (self.plant.ball() - target).norm() < ARRIVED_M
        });
        for _ in 0..30 {
            self.step(target);
        }
        arrived.unwrap()
    }
}

fn params() -> Params {
    let config =
        Config { law: Law::Taut(Estimated { delay: Milliseconds(0) }), ..crate::common::config() };
    Params::check(&config, &Wiring::example().drivers, &EMULATED).unwrap()
}

/// Returns what a law knows of the paper's rig after its task.
pub(crate) fn known_rig() -> KnownRig {
    let task = Task::paper();
    let mut rig = Rig::new(&task);
    rig.drive(task.target);
    rig.worker.known_rig().unwrap()
}

/// Place below the middle of the paper's rig, where a changed rig holds the ball too.
const MIDDLE: Point3<f64> = Point3::new(0.62, 0.27, 0.25);

/// Drives to [`MIDDLE`], and back in a second run on a `changed` rig. Returns by how much the
/// tensions that the law tells at the start of the second run differ most from those at the end of
/// the first one, and the pictures of the way back.
fn second_run(changed: Geometry, is_warm: bool) -> (f64, usize) {
    let task = Task::paper();
    let mut rig = Rig::new(&task);
    rig.drive(MIDDLE);
    let before = rig.step(MIDDLE).map(RelativeTension::to_si);
    if !is_warm {
        rig.worker = LawWorker::new();
    }
    rig.begin_run(changed);
    let after = rig.step(task.start).map(RelativeTension::to_si);
    let difference = (0..MOTORS).map(|k| (after[k] - before[k]).abs()).fold(0.0, f64::max);
    (difference, rig.drive(task.start))
}

#[test]
fn a_law_knows_nothing_before_it_has_moved_the_ball() {
    let task = Task::paper();
    let mut rig = Rig::new(&task);
    assert_eq!(rig.worker.known_rig(), None);
    rig.step(task.target);
    assert_eq!(rig.worker.known_rig(), None);
}

#[test]
fn a_run_begins_with_the_rig_that_the_last_one_has_learnt() {
    let [(cold, _), (warm, _)] =
        [false, true].map(|is_warm| second_run(Geometry::paper(), is_warm));
    assert!(warm < 0.05 && warm < cold / 2.0, "{warm} warm, {cold} cold");
}

#[test]
fn a_rig_is_kept_over_a_run_that_does_not_move() {
    let task = Task::paper();
    let mut rig = Rig::new(&task);
    rig.drive(task.target);
    for _ in 0..3 {
        rig.begin_run(Geometry::paper());
        rig.step(task.target);
        assert!(rig.worker.known_rig().is_some());
    }
}

/// Motors that were moved by 5 cm, and pulleys of another size, cost no more than a tenth over a
/// cold start.
#[test]
fn a_changed_rig_is_noticed() {
    let paper = Geometry::paper();
    let mut moved = *paper.motors();
    moved[0] += nalgebra::Vector3::new(0.03, -0.03, 0.025);
    let pulleys = |factor: f64| paper.pulley_radii_m().map(|radius| factor * radius);
    for changed in [
        Geometry::new(moved, paper.pulley_radii_m()),
        Geometry::new(*paper.motors(), pulleys(1.5)),
        Geometry::new(*paper.motors(), pulleys(1.0 / 1.5)),
    ] {
        let changed = changed.unwrap();
        let [(_, cold), (_, warm)] = [false, true].map(|is_warm| second_run(changed, is_warm));
        assert!(10 * warm <= 11 * cold, "{changed:?}: {warm} pictures warm, {cold} cold");
    }
}
