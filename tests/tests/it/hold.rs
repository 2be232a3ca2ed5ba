//! A Hold while the ball moves: the motors ramp down, and the ball is held where it comes to rest.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use nalgebra::Point3;
use plumb_emulator::plant::{Elastic, ElasticParameters, Plant, QuasiStatic, Task};
use plumb_protocol::message::{Command, State};
use plumb_protocol::units::Point;
use plumb_runtime::rig::{LawName, LawSettings, Rig};
use plumb_tests::bench::{Bench, RATE_HZ, bench};
use plumb_tests::links::link;

/// Farthest that a held ball is from where the board began to hold it, m: the radius within which a
/// target counts as reached.
const NEAR_M: f64 = 0.010;

/// Returns the paper's rig with `law` and motors of at most `max_rate` full steps/s.
fn drive(law: LawName, max_rate: f64, plant: Box<dyn Plant + Send>) -> Bench {
    let mut rig = Rig::paper().unwrap();
    rig.law = LawSettings::from(law);
    rig.motors.max_rate = max_rate.try_into().unwrap();
    let mut bench = bench(&rig, plant, (link("1 ms").wire)(1)).unwrap();
    let target = Point::from_metres(Task::paper().target.into()).unwrap();
    bench.link.request_target(target).unwrap();
    bench
}

/// Runs `frames` with exact positions. Returns the ball's positions, m.
fn run(bench: &mut Bench, frames: u64) -> Vec<Point3<f64>> {
    let mut balls = Vec::new();
    for _ in 0..frames {
        bench.frame(Some).unwrap();
        balls.push(bench.ball());
    }
    balls
}

/// Returns the frames from the Hold until the board holds, and the farthest that the ball then is
/// from where it was when the board began to hold, m.
fn hold(bench: &mut Bench) -> (u64, f64) {
    bench.link.submit(Command::Hold).unwrap();
    let waited = (1..3 * RATE_HZ).find(|_| {
        run(bench, 1);
        bench.state() == State::Holding
    });
    let rest = bench.ball();
    let balls = run(bench, 5 * RATE_HZ);
    assert_eq!(bench.state(), State::Holding);
    let distance = balls.iter().map(|ball| (ball - rest).norm()).fold(0.0, f64::max);
    (waited.unwrap(), distance)
}

fn assert_holds(law: LawName, plant: &dyn Fn() -> Box<dyn Plant + Send>) {
    for max_rate in [100.0, 400.0] {
        for frames in [10, 30, 60] {
            let mut bench = drive(law, max_rate, plant());
            run(&mut bench, frames);
            let case = format!("{law} at {max_rate} steps/s after {frames} frames");
            assert_eq!(bench.state(), State::Seeking, "{case}");
            let (waited, distance) = hold(&mut bench);
            assert!(distance < NEAR_M, "{case}: {distance} m, held after {waited} frames");
        }
    }
}

fn rigid() -> Box<dyn Plant + Send> {
    let task = Task::paper();
    Box::new(QuasiStatic::new(task.geometry, task.start).unwrap())
}

fn elastic() -> Box<dyn Plant + Send> {
    let task = Task::paper();
    Box::new(Elastic::new(task.geometry, ElasticParameters::default(), task.start).unwrap())
}

#[test]
fn a_moving_ball_is_held_where_it_comes_to_rest() {
    for law in LawName::ALL {
        assert_holds(law, &rigid);
    }
}

#[test]
fn a_moving_ball_on_elastic_cables_is_held_where_it_comes_to_rest() {
    for law in LawName::ALL {
        assert_holds(law, &elastic);
    }
}
