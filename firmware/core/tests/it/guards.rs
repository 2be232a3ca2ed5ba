//! The guards that compare the ball's way with the motors and with time.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_protocol::Config;
use plumb_protocol::config::{Following, Progress};
use plumb_protocol::message::*;
use plumb_protocol::units::{Micrometres, Milliseconds, Steps16};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{config, motor};

/// Travel of the motors, full steps: no limit in these tests.
const TRAVEL: i32 = 100_000;
/// Frames in 10 s.
const TEN_SECONDS: u32 = 303;

/// Returns a configuration whose guards stop a drive after `turn` steps without the ball, or after
/// `time_ms` without progress.
fn guarded(turn: i32, time_ms: u16) -> Config {
    Config {
        motors: [motor(400.0, 2000, 16 * TRAVEL); 3].into(),
        following: Following { turn: Steps16(16 * turn), movement: Micrometres(20_000) },
        progress: Progress { margin: Micrometres(1_000), time: Milliseconds(time_ms) },
        ..config()
    }
}

/// Returns a board that seeks [`TARGET`] with the ball at [`BALL`].
fn seeking(config: Config) -> Bench {
    let mut bench = Bench::configured(config);
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench
}

/// Returns the ball at a share of the way from [`BALL`] to [`TARGET`].
fn on_the_way(share: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| BALL[i] + share * (TARGET[i] - BALL[i]))
}

/// Returns the largest turn of a motor since the start, full steps.
fn turned(bench: &Bench) -> u32 {
    bench.harness.board.positions().map(i32::unsigned_abs).into_iter().max().unwrap() / 16
}

#[test]
fn motors_that_turn_without_the_ball_stop_the_board() {
    let mut bench = seeking(guarded(100, 60_000));
    while bench.harness.board.state() == State::Seeking {
        bench.run_with_ball(1, BALL);
        assert!(turned(&bench) < 130, "{} steps and no stop", turned(&bench));
    }
    assert!(turned(&bench) > 100);
    bench.assert_stopped_by(Fault::NotFollowing);
}

/// A ball that wanders by less than the movement of the rule does not follow.
#[test]
fn noise_does_not_pass_for_a_ball_that_follows() {
    let mut bench = seeking(guarded(100, 60_000));
    for frame in 0..TEN_SECONDS {
        let aside = if frame % 20 < 10 { 0.015 } else { 0.0 };
        bench.run_with_ball(1, [BALL[0] + aside, BALL[1] - aside, BALL[2]]);
    }
    assert_eq!(bench.faults(), [Fault::NotFollowing]);
}

#[test]
fn a_ball_that_follows_slowly_is_driven_to_its_target() {
    let mut bench = seeking(guarded(400, 2_000));
    for frame in 0..TEN_SECONDS {
        bench.run_with_ball(1, on_the_way(f64::from(frame) / f64::from(TEN_SECONDS)));
    }
    bench.run_with_ball(30, TARGET);
    assert_eq!((bench.harness.board.state(), bench.faults().len()), (State::Holding, 0));
}

#[test]
fn a_ball_that_gets_no_nearer_stops_the_board() {
    let mut bench = seeking(guarded(100_000, 2_000));
    bench.run_with_ball(59, BALL);
    assert_eq!(bench.harness.board.state(), State::Seeking, "before 2 s");
    bench.run_with_ball(4, BALL);
    bench.assert_stopped_by(Fault::NoProgress);
}

/// Targets come with every position, and between them Stop.
#[test]
fn targets_that_come_often_disarm_no_guard() {
    for (config, fault) in
        [(guarded(100, 60_000), Fault::NotFollowing), (guarded(100_000, 2_000), Fault::NoProgress)]
    {
        for stops in [false, true] {
            let mut bench = seeking(config);
            for frame in 0..TEN_SECONDS {
                let angle = f64::from(frame) * 0.1;
                let aside = [0.05 * angle.cos(), 0.05 * angle.sin()];
                let target = [TARGET[0] + aside[0], TARGET[1] + aside[1], TARGET[2]];
                if stops {
                    let _ = bench.send(Command::Stop);
                }
                let _ = bench.send(Command::Target(point(target)));
                bench.run_with_ball(1, BALL);
            }
            assert_eq!(bench.faults(), [fault], "with stops: {stops}");
        }
    }
}

/// The target keeps the same distance from the ball, which follows it.
#[test]
fn a_ball_that_follows_a_moving_target_makes_progress() {
    let mut bench = seeking(guarded(400, 2_000));
    for frame in 0..TEN_SECONDS {
        let way = f64::from(frame) * 0.002;
        let _ = bench.send(Command::Target(point([BALL[0] + way + 0.1, BALL[1], BALL[2]])));
        bench.run_with_ball(1, [BALL[0] + way, BALL[1], BALL[2]]);
    }
    assert_eq!((bench.harness.board.state(), bench.faults().len()), (State::Seeking, 0));
}

#[test]
fn a_ball_at_its_target_needs_no_progress() {
    let mut bench = seeking(guarded(100, 2_000));
    bench.run_with_ball(2 * TEN_SECONDS, TARGET);
    assert_eq!((bench.harness.board.state(), bench.faults().len()), (State::Holding, 0));
}

#[test]
fn a_drive_from_rest_begins_with_new_guards() {
    let mut bench = seeking(guarded(100, 2_000));
    for _ in 0..10 {
        bench.run_with_ball(8, BALL);
        assert_eq!(bench.send(Command::Stop), Ok(()));
        bench.run_with_ball(20, BALL);
        assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    }
    assert!(turned(&bench) > 200 && bench.faults().is_empty(), "{} steps", turned(&bench));
}
