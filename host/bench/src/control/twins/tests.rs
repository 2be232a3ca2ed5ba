//! The board's fixed point against `f64`.

use nalgebra::Point3;
use plumb_protocol::units::Micros;
use plumb_sim::limits::Limits;

use super::super::contender::{Contender, by_law};
use super::super::simulate::{self, Driver, Outcome};
use super::super::{oracle, run};
use super::*;
use crate::control::Suite;

/// A law with the gain that docs/understand/method.md measures it with.
fn settings(name: &str) -> LawSettings {
    let mut law = LawSettings::named(name).unwrap();
    law.set_gamma(450.0).unwrap();
    law
}

/// A driver whose motor positions are kept, one row a tick.
struct Recorded {
    inner: Box<dyn Driver>,
    rows: Vec<[f64; 3]>,
}

impl Driver for Recorded {
    fn see(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.inner.see(now, age_us, ball);
    }

    fn tick(&mut self, now: Micros) -> [f64; 3] {
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

    fn sent_on(&self) -> bool {
        self.inner.sent_on()
    }
}

/// A whole run of what `contender` makes, or of the board's own law in
/// [`LawDriver`](super::super::law_driver::LawDriver).
fn whole_run(
    contender: Option<&Contender>,
    law: &LawSettings,
    suite: &Suite,
    id: (u64, u64),
) -> (Outcome, Vec<[f64; 3]>) {
    let task = suite.task(id.0, id.1).unwrap();
    let inner = match contender {
        Some(contender) => {
            contender.driver(suite, &task, suite.elasticity(id.0, id.1), id).unwrap()
        }
        None => by_law(law, suite, &task, boards_own).unwrap(),
    };
    let mut driver = Recorded { inner, rows: Vec::new() };
    let oracle_s = oracle::time_s(&task, &Limits::default(), suite.threshold_m).unwrap();
    let outcome = simulate::run(&mut driver, suite, &task, id, oracle_s).unwrap();
    (outcome, driver.rows)
}

/// With the board's own law the twins' harness gives the board's run, up to rounding: nothing but
/// the law differs. In run 101 of seed 5 nothing is seen for half a second.
#[test]
fn the_harness_is_the_board() {
    let (plain, elastic) =
        (Suite::named("quasi-static").unwrap(), Suite::named("elastic").unwrap());
    for name in LawSettings::NAMES {
        let law = LawSettings::named(name).unwrap();
        for (suite, id) in [(&plain, (5, 101)), (&plain, (5, 7)), (&elastic, (8, 2))] {
            let board = whole_run(Some(&Contender::Board(law.clone())), &law, suite, id);
            let harness = whole_run(None, &law, suite, id);
            let apart = farthest(&board.1, &harness.1);
            eprintln!("{name} {} {id:?} {apart}", suite.name);
            assert!(apart <= 0.5, "{name}, {}, {id:?}: {apart} steps apart", suite.name);
        }
    }
    let lost = whole_run(None, &settings("sign"), &plain, (5, 101)).0;
    assert!(lost.sent_on, "this run is here because it loses the ball");
}

/// By how many steps any motor is at most apart from where `f64` has it, in a whole run with the
/// same noise.
fn apart(law: &LawSettings, suite: &Suite, id: (u64, u64)) -> f64 {
    let [board, twin] = [Contender::Board(law.clone()), Contender::Twin(law.clone())]
        .map(|contender| whole_run(Some(&contender), law, suite, id).1);
    farthest(&board, &twin)
}

/// By how many steps any motor is at most apart in two runs.
fn farthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs())).fold(0.0, f64::max)
}

/// Whole runs with the same noise: the motors go the same way. `adaptive` may use its estimate a
/// picture earlier or later than its twin where descent is just certain; `interval`, at a gain that
/// does not chatter, has an α on the chip that is rounded outwards by 0.2 %.
#[test]
fn motors_go_the_same_way_in_fixed_point_and_in_f64() {
    let suite = Suite::named("quasi-static").unwrap();
    for (name, median, most) in
        [("interval", 4.0, 40.0), ("sign", 0.07, 0.2), ("adaptive", 1.0, 40.0)]
    {
        let law = LawSettings::named(name).unwrap();
        let mut steps: Vec<f64> = (0..12).map(|index| apart(&law, &suite, (21, index))).collect();
        steps.sort_by(f64::total_cmp);
        eprintln!("{name}: {steps:?}");
        assert!(steps[6] <= median && steps[11] <= most, "{name}: {steps:?}");
    }
}

/// The bound, on as many rigs: median times within 1 %.
#[test]
fn fixed_point_is_as_fast_as_f64() {
    let suite = Suite::named("quasi-static").unwrap();
    for name in NAMES {
        let law = settings(name);
        let [board, twin] = [Contender::Board(law.clone()), Contender::Twin(law)]
            .map(|contender| run(&contender, &suite, 0..300, 31, &mut |_| ()).unwrap());
        assert!((board.median / twin.median - 1.0).abs() < 0.01, "{board}\n{twin}");
        assert!((board.converged - twin.converged).abs() < 0.005, "{board}\n{twin}");
    }
}
