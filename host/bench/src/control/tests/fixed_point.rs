//! The board's fixed point against its laws in `f64`, written from their equations.

mod adaptive;
mod interval;
mod sign;

use nalgebra::Point3;
use plumb_core::law::{DeferredLaw, Law, LawSelection};
use plumb_core::params::Params;
use plumb_protocol::config::SIGNS;
use plumb_protocol::units::Micros;
use plumb_protocol::{MOTORS, PerMotor};
use plumb_runtime::rig::{LawName, LawSettings};
use plumb_sim::limits::RigLimits;

use super::super::controller::{ControllerKind, by_law};
use super::super::simulate::{self, Controller, Leg, Outcome};
use super::super::{in_parallel, oracle};
use super::run_one_target;
use crate::control::{Report, Suite, SuiteName};
use crate::run_id::RunId;
use adaptive::Adaptive;
use interval::Interval;
use sign::Sign;

/// Names of the laws with a reference. The law `taut` uses floating point on the board, too.
const LAWS: [LawName; 3] = [LawName::Interval, LawName::Sign, LawName::Adaptive];

/// Returns the law in `f64`; of `taut` the board's own.
fn in_f64(law: &LawSettings, params: &Params) -> Box<dyn Law> {
    match law {
        LawSettings::Interval { gamma, alpha, beta, .. } => {
            Box::new(Interval::new(gamma.get(), (alpha.get(), beta.get()), &SIGNS))
        }
        LawSettings::Sign { gain, .. } => Box::new(Sign::new(gain.get())),
        LawSettings::Adaptive(_) => Box::new(Adaptive::new(RigLimits::default())),
        LawSettings::Taut(_) => boards_own(params),
    }
}

/// Returns the law of a board with these parameters.
fn boards_own(params: &Params) -> Box<dyn Law> {
    match params.law() {
        LawSelection::Inline(law) => Box::new(law),
        LawSelection::Deferred(kind) => {
            Box::new(DeferredLaw::new(kind, params.limits(), None, &mut None))
        }
    }
}

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

/// A law on the board, or in [`LawController`](super::super::law_controller::LawController).
type Build<'a> = &'a dyn Fn(&Suite, &super::Task, RunId) -> Box<dyn Controller>;

/// Result of a run, its motor positions, and the oracle's time.
struct WholeRun {
    outcome: Outcome,
    rows: Vec<PerMotor<f64>>,
    oracle_s: f64,
}

/// Runs a controller.
fn whole_run(build: Build, suite: &Suite, id: RunId) -> WholeRun {
    let task = suite.task(id).unwrap();
    let mut controller = Recorded { inner: build(suite, &task, id), rows: Vec::new() };
    let oracle_s = oracle::time_s(&task, &RigLimits::default(), suite.threshold_m).unwrap();
    let leg = Leg { target: task.target, oracle_s, changed: None };
    let mut outcomes = simulate::run(&mut controller, suite, &task, id, (&[leg], None)).unwrap();
    WholeRun { outcome: outcomes.remove(0), rows: controller.rows, oracle_s }
}

/// Runs the law on the board.
fn on_board(law: &LawSettings, suite: &Suite, id: RunId) -> WholeRun {
    let kind = ControllerKind::Board(law.clone());
    whole_run(&|suite, task, id| kind.build(suite, task, id).unwrap(), suite, id)
}

/// Runs the law that `of` makes in the harness.
fn in_harness(
    law: &LawSettings,
    of: fn(&LawSettings, &Params) -> Box<dyn Law>,
    suite: &Suite,
    id: RunId,
) -> WholeRun {
    let build = |suite: &Suite, task: &super::Task, _| -> Box<dyn Controller> {
        Box::new(by_law(law, suite, task, |params| of(law, params)).unwrap())
    };
    whole_run(&build, suite, id)
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
            let board = on_board(&law, suite, id);
            let harness = in_harness(&law, |_, params| boards_own(params), suite, id);
            let apart = farthest(&board.rows, &harness.rows);
            eprintln!("{name} {} {id:?} {apart}", suite.name);
            assert!(apart <= 0.5, "{name}, {}, {id:?}: {apart} steps apart", suite.name);
        }
    }
    let (law, id) = (settings(LawName::Sign), RunId { seed: 5, rig: 101 });
    let lost = in_harness(&law, |_, params| boards_own(params), &plain, id);
    assert!(lost.outcome.resumed, "this run is here because it loses the ball");
}

/// With two motors, too. The third one rests for the whole run.
#[test]
fn the_harness_is_the_board_of_two_motors() {
    for (name, suite) in LAWS.into_iter().flat_map(|name| {
        [SuiteName::Planar, SuiteName::Planar800].map(|suite| (name, Suite::new(suite)))
    }) {
        let (law, id) = (LawSettings::from(name), RunId { seed: 5, rig: 7 });
        let board = on_board(&law, &suite, id);
        assert!(board.outcome.time_s.is_some(), "{name}: {:?}", board.outcome.end);
        let harness = in_harness(&law, |_, params| boards_own(params), &suite, id);
        let apart = farthest(&board.rows, &harness.rows);
        assert!(apart <= 0.5, "{name}, {}: {apart} steps apart", suite.name);
        assert!(board.rows.iter().all(|motors| motors[2] == 0.0), "{name}, {}", suite.name);
    }
}

/// By how many steps any motor is at most apart from where `f64` has it, in a whole run with the
/// same noise.
fn apart(law: &LawSettings, suite: &Suite, id: RunId) -> f64 {
    farthest(&on_board(law, suite, id).rows, &in_harness(law, in_f64, suite, id).rows)
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
        let board = run_one_target(&ControllerKind::Board(law.clone()), &suite, 0..300, 31);
        let run = |rig| {
            let run = in_harness(&law, in_f64, &suite, RunId { seed: 31, rig });
            Ok((run.outcome, run.oracle_s))
        };
        let runs = in_parallel(0..300, run, &mut |_| ()).unwrap();
        let first = RunId { seed: 31, rig: 0 };
        let reference = Report::new((format!("{name} in f64"), 1), suite.name, first, &runs);
        assert!((board.median / reference.median - 1.0).abs() < 0.01, "{board}\n{reference}");
        assert!((board.converged - reference.converged).abs() < 0.005, "{board}\n{reference}");
    }
}
