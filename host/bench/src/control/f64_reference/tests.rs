//! The board's fixed point against `f64`.

use nalgebra::Point3;
use plumb_protocol::units::Micros;
use plumb_protocol::{MOTORS, PerMotor};
use plumb_sim::limits::RigLimits;

use super::super::controller::{ControllerKind, by_law};
use super::super::oracle;
use super::super::simulate::{self, Controller, Leg, Outcome};
use super::super::tests::run_one_target;
use super::*;
use crate::control::{Suite, SuiteName};
use crate::run_id::RunId;

/// Returns a law with the gain of docs/understand/method.md.
fn settings(name: LawName) -> LawSettings {
    let mut law = LawSettings::from(name);
    law.set_gamma(450.0).unwrap();
    law
}

/// A controller that records its motor positions, one row a tick.
struct Recorded {
    inner: Box<dyn Controller>,
    rows: Vec<PerMotor<f64>>,
}

impl Controller for Recorded {
    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.inner.on_position(now, age_us, ball);
    }

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        let motors = self.inner.tick(now);
        self.rows.push(motors);
        motors
    }

    fn reached(&self) -> bool {
        self.inner.reached()
    }

    fn failed(&self) -> bool {
        self.inner.failed()
    }

    fn resumed(&self) -> bool {
        self.inner.resumed()
    }
}

/// Runs `controller` or, if it is `None`, the board's own law in
/// [`LawController`](super::super::law_controller::LawController). Returns the motor positions,
/// too.
fn whole_run(
    controller: Option<&ControllerKind>,
    law: &LawSettings,
    suite: &Suite,
    id: RunId,
) -> (Outcome, Vec<PerMotor<f64>>) {
    let task = suite.task(id).unwrap();
    let inner = match controller {
        Some(controller) => controller.build(suite, &task, id).unwrap(),
        None => Box::new(by_law(law, suite, &task, boards_own).unwrap()),
    };
    let mut controller = Recorded { inner, rows: Vec::new() };
    let oracle_s = oracle::time_s(&task, &RigLimits::default(), suite.threshold_m).unwrap();
    let leg = Leg { target: task.target, oracle_s, changed: None };
    let mut outcomes = simulate::run(&mut controller, suite, &task, id, &[leg]).unwrap();
    (outcomes.remove(0), controller.rows)
}

/// With the board's own law the harness of the `f64` laws gives the board's run, up to rounding:
/// nothing but the law differs. In run 101 of seed 5 nothing is seen for half a second.
#[test]
fn the_harness_is_the_board() {
    let (plain, elastic) = (Suite::new(SuiteName::QuasiStatic), Suite::new(SuiteName::Elastic));
    for name in LawName::ALL {
        let law = LawSettings::from(name);
        for (suite, seed, rig) in [(&plain, 5, 101), (&plain, 5, 7), (&elastic, 8, 2)] {
            let id = RunId { seed, rig };
            let board = whole_run(Some(&ControllerKind::Board(law.clone())), &law, suite, id);
            let harness = whole_run(None, &law, suite, id);
            let apart = farthest(&board.1, &harness.1);
            eprintln!("{name} {} {id:?} {apart}", suite.name);
            assert!(apart <= 0.5, "{name}, {}, {id:?}: {apart} steps apart", suite.name);
        }
    }
    let lost = whole_run(None, &settings(LawName::Sign), &plain, RunId { seed: 5, rig: 101 }).0;
    assert!(lost.resumed, "this run is here because it loses the ball");
}

/// By how many steps any motor is at most apart from where `f64` has it, in a whole run with the
/// same noise.
fn apart(law: &LawSettings, suite: &Suite, id: RunId) -> f64 {
    let [board, reference] = [ControllerKind::Board(law.clone()), ControllerKind::F64(law.clone())]
        .map(|controller| whole_run(Some(&controller), law, suite, id).1);
    farthest(&board, &reference)
}

/// By how many steps any motor is at most apart in two runs.
fn farthest(a: &[PerMotor<f64>], b: &[PerMotor<f64>]) -> f64 {
    a.iter().zip(b).flat_map(|(a, b)| (0..MOTORS).map(|k| (a[k] - b[k]).abs())).fold(0.0, f64::max)
}

/// Whole runs with the same noise: the motors go the same way. `adaptive` may use its estimate a
/// frame earlier or later than its reference where descent is just certain; `interval`, at a gain
/// that does not chatter, has an α on the chip that is rounded outwards by 0.2 %.
#[test]
fn motors_go_the_same_way_in_fixed_point_and_in_f64() {
    let suite = Suite::new(SuiteName::QuasiStatic);
    for (name, median, most) in
        [(LawName::Interval, 4.0, 40.0), (LawName::Sign, 0.07, 0.2), (LawName::Adaptive, 1.0, 40.0)]
    {
        let law = LawSettings::from(name);
        let mut steps: Vec<f64> =
            (0..12).map(|rig| apart(&law, &suite, RunId { seed: 21, rig })).collect();
        steps.sort_by(f64::total_cmp);
        eprintln!("{name}: {steps:?}");
        assert!(steps[6] <= median && steps[11] <= most, "{name}: {steps:?}");
    }
}

/// The bound, on as many rigs: median times within 1 %.
#[test]
fn fixed_point_is_as_fast_as_f64() {
    let suite = Suite::new(SuiteName::QuasiStatic);
    for name in LAWS {
        let law = settings(name);
        let [board, reference] = [ControllerKind::Board(law.clone()), ControllerKind::F64(law)]
            .map(|controller| run_one_target(&controller, &suite, 0..300, 31));
        assert!((board.median / reference.median - 1.0).abs() < 0.01, "{board}\n{reference}");
        assert!((board.converged - reference.converged).abs() < 0.005, "{board}\n{reference}");
    }
}
