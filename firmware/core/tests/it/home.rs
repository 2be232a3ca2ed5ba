//! Jogs within their own limits, and the zero of travel.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use plumb_protocol::Config;
use plumb_protocol::config::JogLimits;
use plumb_protocol::message::*;
use plumb_protocol::units::{Rate, Steps16};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{config, motor};

/// Returns a jog of motor B by `steps` full steps at `rate` full steps/s.
fn jog(steps: i32, rate: i32) -> Command {
    Command::Jog(Jog { motor: 1, distance: Steps16(16 * steps), rate: Rate(256 * rate) })
}

/// Returns a configuration with `travel` in full steps, and limits of jogs.
fn limited(travel: i32) -> Config {
    let jog = JogLimits { max_rate: Rate(256 * 100), max_distance: Steps16(16 * 60) };
    Config { motors: [motor(400.0, 2000, 16 * travel); 3].into(), jog, ..config() }
}

/// Jogs by `steps` to the end.
fn jogged(bench: &mut Bench, steps: i32) {
    assert_eq!(bench.send(jog(steps, 100)), Ok(()));
    while bench.harness.board.state() != State::Ready {
        assert_eq!(bench.send(Command::Status), Ok(()));
        bench.run_ms(20);
    }
}

/// Returns the motor positions of the newest telemetry, 1/16 steps.
fn reported(bench: &mut Bench) -> [i32; 3] {
    assert_eq!(bench.send(Command::Status), Ok(()));
    let motors = bench.received.iter().rev().find_map(|message| match message {
        FromBoard::Telemetry(telemetry) => Some(telemetry.motors),
        _ => None,
    });
    motors.unwrap().steppable(Steps16(0)).map(|motor| motor.0)
}

#[test]
fn a_jog_beyond_its_own_limits_is_refused() {
    let mut bench = Bench::configured(limited(1000));
    assert_eq!(bench.send(jog(10, 101)), Err(Refusal::JogRate));
    assert_eq!(bench.send(jog(61, 100)), Err(Refusal::JogDistance));
    assert_eq!(bench.send(jog(-61, 100)), Err(Refusal::JogDistance));
    jogged(&mut bench, 60);
    jogged(&mut bench, -60);
    assert_eq!(bench.harness.board.positions(), [0; 3]);
}

#[test]
fn a_stop_during_a_jog_ramps_down() {
    let mut bench = Bench::configured(limited(1000));
    assert_eq!(bench.send(jog(60, 100)), Ok(()));
    bench.run_ms(200);
    assert_eq!(bench.send(Command::Stop), Ok(()));
    let mut last = bench.harness.board.rates()[1];
    assert_eq!(last, 100 * 256);
    while bench.harness.board.state() != State::Ready {
        bench.tick();
        let rate = bench.harness.board.rates()[1];
        // 2000 steps/s² is 0.4 steps/s a tick.
        assert!((0..=103).contains(&(last - rate)), "{last} to {rate} Q8 steps/s");
        last = rate;
    }
    assert!(!bench.moving() && bench.harness.board.positions()[1] < 16 * 30);
}

#[test]
fn home_makes_the_present_positions_zero_and_moves_nothing() {
    let mut bench = Bench::configured(limited(100));
    for steps in [60, 40] {
        jogged(&mut bench, steps);
    }
    assert_eq!(reported(&mut bench), [0, 1600, 0]);
    assert_eq!(bench.send(jog(1, 100)), Err(Refusal::JogTravel));
    assert_eq!(bench.send(Command::Home), Ok(()));
    assert_eq!((reported(&mut bench), bench.harness.board.positions()), ([0; 3], [0, 1600, 0]));
    bench.run_ms(100);
    assert_eq!(bench.harness.board.positions(), [0, 1600, 0]);
    // The travel is about the new zero.
    for steps in [60, 40] {
        jogged(&mut bench, steps);
    }
    assert_eq!(
        (reported(&mut bench), bench.harness.board.positions()),
        ([0, 1600, 0], [0, 3200, 0])
    );
    assert_eq!(bench.send(jog(1, 100)), Err(Refusal::JogTravel));
}

#[test]
fn the_travel_about_a_new_zero_stops_a_drive() {
    let mut bench = Bench::configured(limited(20));
    jogged(&mut bench, 20);
    assert_eq!(bench.send(Command::Home), Ok(()));
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(60, BALL);
    let State::Fault(fault @ Fault::Travel(_)) = bench.harness.board.state() else {
        panic!("{:?}", bench.harness.board.state())
    };
    assert!(reported(&mut bench).iter().all(|position| position.abs() <= 16 * 20));
    assert_eq!(bench.faults(), [fault]);
}

#[test]
fn home_ends_the_stay_outside_a_narrower_travel() {
    let mut bench = Bench::configured(limited(100));
    jogged(&mut bench, 60);
    assert_eq!(bench.send(Command::Configure(limited(50))), Ok(()));
    bench.run_with_ball(5, BALL);
    assert_eq!(bench.send(Command::Hold), Err(Refusal::OutsideTravel(1)));
    assert_eq!(bench.send(Command::Home), Ok(()));
    assert_eq!(bench.send(Command::Hold), Ok(()));
}

/// A fault is looked at and cleared before the zero changes.
#[test]
fn home_needs_a_board_that_is_ready() {
    let mut bench = Bench::configured(limited(100));
    assert_eq!(bench.send(jog(60, 100)), Ok(()));
    bench.run_ms(50);
    assert_eq!(bench.send(Command::Home), Err(Refusal::Busy(State::Jogging)));
    bench.run_ms(302);
    let silent = Fault::HostSilent;
    assert_eq!(bench.send(Command::Home), Err(Refusal::Faulted(silent)));
    bench.run_ms(300);
    assert_eq!(bench.send(Command::ClearFault), Ok(()));
    assert_eq!(bench.send(Command::Home), Ok(()));
    assert_eq!(reported(&mut bench), [0; 3]);
}
