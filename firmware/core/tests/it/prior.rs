//! What a host knows of a rig: which priors a board takes, and what its laws make of them.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use nalgebra::{Matrix3, Point3, Vector3};
use plumb_emulator::plant::{Geometry, Task};
use plumb_protocol::config::{Config, Estimated, Law};
use plumb_protocol::message::{Command, ConfigField, FromBoard, Refusal, State, Telemetry};
use plumb_protocol::prior::{JacobianPrior, Prior, RigPrior};
use plumb_protocol::units::{Micrometres, Milliseconds, Point, RelativeTension};

use super::common::bench::{Bench, point};
use super::common::{BUILD, config, wiring};

const ESTIMATED: Estimated = Estimated { delay: Milliseconds(0) };

fn adaptive() -> Config {
    Config { law: Law::Adaptive(ESTIMATED), ..config() }
}

fn taut() -> Config {
    Config { law: Law::Taut(ESTIMATED), ..config() }
}

/// Returns the prior that a tape measure gives of this rig.
fn tape(rig: &Geometry) -> RigPrior {
    RigPrior {
        motors: rig.motors().map(|motor| Point::from_metres(motor.into()).unwrap()).into(),
        deviation: Micrometres(20_000),
        cable_per_step: rig.step_lengths_m().map(|metres| (metres * 1e9) as u32).into(),
        cable_deviation: 102,
    }
}

/// Returns the movement of the ball at `ball` for a step of each motor, metres.
fn jacobian(ball: &Point3<f64>) -> Matrix3<f64> {
    let rig = Geometry::paper();
    rig.jacobian(ball).unwrap() * Matrix3::from_diagonal(&Vector3::from(rig.step_lengths_m()))
}

/// Returns the prior of a J (metres/step) that is known to 5 µm/step.
fn known(j: &Matrix3<f64>) -> JacobianPrior {
    let row = |i: usize| [0, 1, 2].map(|k| (j[(i, k)] * 1e6) as i32).into();
    JacobianPrior { entries: [0, 1, 2].map(row), deviations: [[5; 3].into(); 3], common: 0 }
}

fn paper_jacobian() -> JacobianPrior {
    known(&jacobian(&Task::paper().start))
}

#[test]
fn a_prior_is_for_the_law_and_the_motors_of_the_configuration() {
    let (j, rig) = (paper_jacobian(), tape(&Geometry::paper()));
    let refused = Err(Refusal::Config(ConfigField::Prior));
    for (config, prior, expected) in [
        (adaptive(), Prior::Jacobian(j), Ok(())),
        (taut(), Prior::Rig(rig), Ok(())),
        (adaptive(), Prior::Rig(rig), refused),
        (taut(), Prior::Jacobian(j), refused),
        (config(), Prior::Rig(rig), refused),
        (adaptive(), Prior::Jacobian(JacobianPrior { entries: [[1; 2].into(); 3], ..j }), refused),
        (
            adaptive(),
            Prior::Jacobian(JacobianPrior { entries: [[4001; 3].into(); 3], ..j }),
            refused,
        ),
        (
            adaptive(),
            Prior::Jacobian(JacobianPrior { deviations: [[501; 3].into(); 3], ..j }),
            refused,
        ),
        (taut(), Prior::Rig(RigPrior { motors: [Point::default(); 2].into(), ..rig }), refused),
        (taut(), Prior::Rig(RigPrior { deviation: Micrometres(0), ..rig }), refused),
        (taut(), Prior::Rig(RigPrior { cable_per_step: [1, 0, 1].into(), ..rig }), refused),
        (taut(), Prior::Rig(RigPrior { cable_deviation: 0, ..rig }), refused),
    ] {
        let mut bench = Bench::wired(wiring(), config);
        assert_eq!(bench.send(Command::Prior(prior)), expected, "{prior:?}");
    }
}

#[test]
fn a_prior_needs_a_configuration_and_motors_at_rest() {
    let prior = Command::Prior(Prior::Jacobian(paper_jacobian()));
    assert_eq!(Bench::greeted(BUILD).send(prior), Err(Refusal::Unconfigured));
    let mut bench = Bench::wired(wiring(), adaptive());
    bench.send_ball(Task::paper().start.into());
    assert_eq!(bench.send(Command::Target(point(Task::paper().target.into()))), Ok(()));
    assert_eq!(bench.send(prior), Err(Refusal::Busy(State::Seeking)));
}

/// Returns the motor positions after a third of a second of a drive from the paper's start.
fn turned(prior: Option<Prior>, config: Config) -> (Bench, Vector3<f64>) {
    let task = Task::paper();
    let mut bench = Bench::wired(wiring(), config);
    if let Some(prior) = prior {
        assert_eq!(bench.send(Command::Prior(prior)), Ok(()));
    }
    bench.send_ball(task.start.into());
    assert_eq!(bench.send(Command::Target(point(task.target.into()))), Ok(()));
    bench.run_with_ball(3, task.start.into());
    let turned = Vector3::from(bench.harness.board.positions().map(f64::from));
    (bench, turned)
}

/// The motors turn along J⁻¹ e, where J is that of the rig; without a prior they turn elsewhere.
#[test]
fn adaptive_begins_along_the_way_of_a_known_jacobian() {
    let task = Task::paper();
    let way = jacobian(&task.start).try_inverse().unwrap() * (task.target - task.start);
    let [known, guessed] = [Some(Prior::Jacobian(paper_jacobian())), None]
        .map(|prior| turned(prior, adaptive()).1.angle(&way).to_degrees());
    assert!(known < 3.0 && guessed > 3.0 * known, "{known}° with, {guessed}° without");
}

/// Returns the tensions that a board tells, over the ball's weight.
fn told(bench: &mut Bench) -> [f64; 3] {
    bench.received.clear();
    assert_eq!(bench.send(Command::Status), Ok(()));
    let telemetry = bench.received.iter().find_map(|message| match message {
        FromBoard::Telemetry(Telemetry { tensions, .. }) => *tensions,
        _ => None,
    });
    let tensions: Vec<f64> =
        telemetry.unwrap().iter().copied().map(RelativeTension::to_si).collect();
    tensions.try_into().unwrap()
}

#[test]
fn taut_begins_with_the_rig_of_a_tape_measure() {
    let (rig, start) = (Geometry::paper(), Task::paper().start);
    let truth = rig.tensions_per_weight(&start).unwrap();
    let off = |prior| {
        let told = told(&mut turned(prior, taut()).0);
        (0..3).map(|k| (told[k] - truth[k]).abs()).fold(0.0, f64::max)
    };
    let (known, guessed) = (off(Some(Prior::Rig(tape(&rig)))), off(None));
    assert!(guessed > 3.0 * known, "{known} with, {guessed} without");
}

/// A rig in feet, read as metres, is beyond what the filters take: they begin as without.
#[test]
fn taut_drops_a_rig_that_is_far_too_large() {
    let paper = tape(&Geometry::paper());
    let feet = RigPrior {
        motors: paper.motors.map(|at| Point(at.0.map(|um| Micrometres(um.0 / 10 * 33)))),
        ..paper
    };
    assert_eq!(turned(Some(Prior::Rig(feet)), taut()).1, turned(None, taut()).1);
}
