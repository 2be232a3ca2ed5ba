//! Each deadline and guard stops the board, one at a time.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_protocol::Config;
use plumb_protocol::message::*;

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{config, motor};

#[test]
fn a_silent_host_stops_the_board() {
    let mut bench = Bench::seeking();
    bench.run_ms(300);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::HostSilent));
    bench.assert_stopped_by(Fault::HostSilent);
}

#[test]
fn positions_without_a_ball_stop_the_board() {
    let mut bench = Bench::seeking();
    for _ in 0..16 {
        assert_eq!(bench.send_position(None, 0), Ok(()));
        bench.run_ms(33);
    }
    bench.assert_stopped_by(Fault::PositionLost);
}

#[test]
fn stale_positions_do_not_count_as_fresh() {
    let mut bench = Bench::seeking();
    for _ in 0..16 {
        assert_eq!(bench.send_position(Some(BALL), 251_000), Err(Refusal::PositionStale));
        bench.run_ms(33);
    }
    bench.assert_stopped_by(Fault::PositionLost);
}

#[test]
fn a_target_without_any_position_ends_in_a_fault() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    for _ in 0..16 {
        assert_eq!(bench.send_position(None, 0), Ok(()));
        bench.run_ms(33);
        assert!(!bench.moving());
    }
    bench.assert_stopped_by(Fault::PositionLost);
}

#[test]
fn rates_are_reduced_while_positions_fail_to_come() {
    let mut bench = Bench::seeking();
    let before = bench.harness.board.rates().map(i32::abs).into_iter().max().unwrap();
    for _ in 0..10 {
        let _ = bench.send_position(None, 0);
        bench.run_ms(33);
    }
    let after = bench.harness.board.rates().map(i32::abs).into_iter().max().unwrap();
    assert_eq!(after, before * 3 / 10);
}

#[test]
fn a_ball_outside_stops_the_board_after_three_frames_in_a_row() {
    let outside = [0.5, 0.2, 1.5];
    let mut bench = Bench::seeking();
    for _ in 0..5 {
        assert_eq!(bench.send_position(Some(outside), 0), Err(Refusal::BallOutside));
        bench.run_ms(33);
        bench.run_with_ball(2, BALL);
    }
    assert_eq!(bench.harness.board.state(), State::Seeking);
    for _ in 0..3 {
        let _ = bench.send_position(Some(outside), 0);
        bench.run_ms(33);
    }
    bench.assert_stopped_by(Fault::BallOutside);
}

#[test]
fn a_target_outside_is_refused_and_stops_a_drive() {
    let mut bench = Bench::configured(config());
    for absurd in [[0.4, 0.4, 0.7], [-1.1, 0.0, 0.0], [2000.0, 0.0, 0.0]] {
        assert_eq!(bench.send(Command::Target(point(absurd))), Err(Refusal::TargetOutside));
        assert_eq!(bench.harness.board.state(), State::Ready);
    }
    let mut bench = Bench::seeking();
    assert_eq!(bench.send(Command::Target(point([0.4, 0.4, 0.7]))), Err(Refusal::TargetOutside));
    bench.assert_stopped_by(Fault::TargetOutside);
}

#[test]
fn a_motor_at_its_travel_stops_the_board() {
    let motors = [motor(400.0, 2000, 16 * 20); 3];
    let mut bench = Bench::configured(Config { motors: motors.into(), ..config() });
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(60, BALL);
    let State::Fault(fault @ Fault::Travel(_)) = bench.harness.board.state() else {
        panic!("{:?}", bench.harness.board.state())
    };
    assert!(bench.harness.board.positions().iter().all(|p| p.abs() <= 16 * 20));
    bench.assert_stopped_by(fault);
}

#[test]
fn an_error_that_keeps_growing_stops_the_board() {
    let mut bench = Bench::seeking();
    for step in 0..60 {
        let away = f64::from(step) * 0.005;
        bench.run_with_ball(1, [BALL[0] + away, BALL[1] - away, BALL[2]]);
    }
    assert_eq!(bench.faults(), [Fault::ErrorGrowing]);
}
