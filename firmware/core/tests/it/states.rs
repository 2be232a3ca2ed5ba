//! Transitions of the board's states where two things happen at once: a fault, a Store, the
//! bootloader, a Hold.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::board::FlashTask;
use plumb_protocol::Config;
use plumb_protocol::frame::encode;
use plumb_protocol::message::*;
use plumb_protocol::units::{Micrometres, Micros, Milliseconds, Point, Rate, Steps16};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{BUILD, config, wiring};

/// Reports a motor driver that does not answer.
fn fail_driver(bench: &mut Bench) {
    bench.harness.on_driver_failure(Micros(bench.now), DriverFault::Hat);
    bench.collect();
}

/// Opens the emergency input for a tick.
fn open_emergency(bench: &mut Bench) {
    bench.harness.on_emergency_stop(Micros(bench.now), [0; 3]);
    bench.collect();
}

/// Reports the end of a write to flash.
fn stored(bench: &mut Bench, written: bool) -> Vec<Result<(), Refusal>> {
    let _ = bench.answers();
    bench.harness.on_stored(Micros(bench.now), written);
    bench.answers()
}

/// Returns the newest telemetry, after a tick that sends it.
fn telemetry(bench: &mut Bench) -> Telemetry {
    assert_eq!(bench.send(Command::Status), Ok(()));
    let telemetry = |message: &FromBoard| match message {
        FromBoard::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    };
    bench.received.iter().rev().find_map(telemetry).unwrap()
}

#[test]
fn the_generation_and_the_wiring_are_those_of_the_configuration() {
    let mut bench = Bench::greeted(BUILD);
    assert_eq!((bench.harness.board.generation(), bench.harness.board.wiring()), (0, None));
    assert!(bench.harness.board.driver_timing().is_none());
    for generation in 1..4 {
        assert_eq!(bench.send(Command::Configure(config())), Ok(()));
        assert_eq!(bench.harness.board.generation(), generation);
    }
    assert_eq!(bench.harness.board.wiring(), Some(&wiring()));
    assert!(bench.harness.board.driver_timing().is_some());
}

#[test]
fn a_driver_that_fails_stops_the_board() {
    let mut bench = Bench::seeking();
    fail_driver(&mut bench);
    assert_eq!(bench.faults(), [Fault::Driver(DriverFault::Hat)]);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
}

#[test]
fn a_fault_is_cleared_only_at_standstill() {
    let mut bench = Bench::seeking();
    bench.run_with_ball(20, BALL);
    fail_driver(&mut bench);
    let busy = Err(Refusal::Busy(State::Fault(Fault::Driver(DriverFault::Hat))));
    assert!(bench.moving());
    assert_eq!(bench.send(Command::ClearFault), busy);
    while bench.moving() {
        bench.tick();
    }
    assert_eq!(bench.send(Command::ClearFault), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Ready);
}

#[test]
fn a_position_as_old_as_the_limit_is_accepted() {
    let mut bench = Bench::seeking();
    let limit_us = u32::from(config().deadlines.max_age.0) * 1000;
    assert_eq!(bench.send_position(Some(BALL), limit_us), Ok(()));
    assert_eq!(bench.send_position(Some(BALL), limit_us + 1), Err(Refusal::PositionStale));
}

#[test]
fn a_decoded_position_before_the_greeting_is_refused() {
    let mut bench = Bench::new(BUILD);
    bench.harness.board.restore(&wiring(), &config());
    let position = Position { sequence: 1, age_us: 0, ball: Some(point(BALL)), covariance: None };
    bench.harness.board.on_position(Micros(bench.now), 5, &position, &mut bench.harness.outbox);
    assert_eq!(bench.answers(), [Err(Refusal::NotGreeted)]);
}

#[test]
fn an_outbox_is_empty_until_a_message_comes_and_after_it_was_sent() {
    let mut bench = Bench::new(BUILD);
    assert!(bench.harness.outbox.is_empty());
    bench.harness.on_driver_failure(Micros(bench.now), DriverFault::Hat);
    assert!(!bench.harness.outbox.is_empty(), "a message waits");
    assert!(!bench.harness.outbox.bytes().is_empty());
    assert!(!bench.harness.outbox.is_empty(), "bytes wait");
    bench.collect();
    assert!(bench.harness.outbox.is_empty());
    assert_eq!(bench.harness.outbox.dropped(), 0);
}

#[test]
fn an_outbox_counts_every_message_that_did_not_fit() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.harness.outbox.dropped(), 0);
    for id in 0..200 {
        let frame = encode(&ToBoard { id, command: Command::Status });
        bench.harness.receive(Micros(bench.now), &frame.unwrap());
    }
    let lost_before = bench.harness.outbox.dropped();
    bench.received.clear();
    bench.collect();
    // Each Status asks for an answer and telemetry.
    let lost = 400 - bench.received.len() as u32;
    assert!(
        lost_before > 1 && lost == bench.harness.outbox.dropped(),
        "{lost} of {}",
        bench.harness.outbox.dropped()
    );
}

#[test]
fn a_store_that_failed_is_tried_again_by_its_repetition() {
    let mut bench = Bench::configured(config());
    let _ = bench.send_as(40, Command::Store);
    assert_eq!(bench.tick().flash, Some(FlashTask::Store));
    assert_eq!(stored(&mut bench, false), [Err(Refusal::NotStored)]);
    let _ = bench.send_as(40, Command::Store);
    assert_eq!(bench.tick().flash, Some(FlashTask::Store), "the repetition writes");
    assert_eq!(stored(&mut bench, true), [Ok(())]);
    let _ = bench.send_as(40, Command::Store);
    assert_eq!(bench.tick().flash, None, "it is written");
    assert_eq!(bench.answers(), [Ok(())]);
}

#[test]
fn a_configuration_with_the_id_of_another_is_carried_out() {
    let mut bench = Bench::greeted(BUILD);
    let other = Config { mean: Milliseconds(100), ..config() };
    for (config, generation) in [(config(), 1), (config(), 1), (other, 2), (other, 2)] {
        assert_eq!(bench.send_as(40, Command::Configure(config)), Ok(()));
        assert_eq!(
            (bench.harness.board.config(), bench.harness.board.generation()),
            (Some(&config), generation)
        );
    }
}

#[test]
fn a_store_goes_on_through_faults_and_is_answered() {
    let mut bench = Bench::configured(config());
    let _ = bench.send(Command::Store);
    fail_driver(&mut bench);
    open_emergency(&mut bench);
    let tick = bench.tick();
    assert!(tick.flash == Some(FlashTask::Store) && !tick.bootloader, "{tick:?}");
    assert_eq!(stored(&mut bench, true), [Ok(())]);
    assert_eq!(bench.tick().flash, None);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
}

#[test]
fn a_store_in_a_fault_leaves_the_fault() {
    let mut bench = Bench::configured(config());
    fail_driver(&mut bench);
    let _ = bench.send(Command::Store);
    assert_eq!(bench.tick().flash, Some(FlashTask::Store));
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
    assert_eq!(stored(&mut bench, true), [Ok(())]);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
    assert_eq!(bench.tick().flash, None);
}

#[test]
fn the_bootloader_waits_for_a_store() {
    for is_faulted in [false, true] {
        let mut bench = Bench::configured(config());
        let _ = bench.send(Command::Store);
        if is_faulted {
            fail_driver(&mut bench);
        }
        assert_eq!(bench.send(Command::Bootloader), Ok(()));
        for _ in 0..5 {
            let tick = bench.tick();
            assert!(tick.flash == Some(FlashTask::Store) && !tick.bootloader, "{tick:?}");
        }
        assert_eq!(stored(&mut bench, true), [Ok(())]);
        let tick = bench.tick();
        assert!(tick.flash.is_none() && tick.bootloader, "{tick:?}");
    }
}

#[test]
fn a_board_on_its_way_to_the_bootloader_gets_there_through_a_fault() {
    let mut bench = Bench::seeking();
    bench.run_with_ball(20, BALL);
    assert_eq!(bench.send(Command::Bootloader), Ok(()));
    assert!(!bench.tick().bootloader);
    fail_driver(&mut bench);
    open_emergency(&mut bench);
    assert!(bench.tick().bootloader);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
}

#[test]
fn a_board_in_a_fault_goes_to_the_bootloader_and_keeps_its_fault() {
    let mut bench = Bench::seeking();
    fail_driver(&mut bench);
    assert!(!bench.tick().bootloader);
    assert_eq!(bench.send(Command::Bootloader), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
    bench.run_ms(500);
    assert!(bench.outputs.bootloader);
}

/// A Hold in motion counts eight positions from standstill on.
#[test]
fn a_hold_in_motion_waits_for_eight_positions_at_standstill() {
    let mut bench = Bench::seeking();
    bench.run_with_ball(20, BALL);
    assert_eq!(bench.send(Command::Hold), Ok(()));
    let hold = bench.id;
    while bench.moving() {
        assert_eq!(bench.harness.board.state(), State::Stopping);
        bench.run_with_ball(1, BALL);
    }
    // Time without a position does not count.
    bench.run_ms(100);
    for _ in 0..7 {
        bench.run_with_ball(1, BALL);
        assert_eq!(bench.harness.board.state(), State::Stopping);
    }
    bench.run_with_ball(1, BALL);
    assert_eq!(bench.harness.board.state(), State::Holding);
    assert_eq!(telemetry(&mut bench).target, Some(hold));
}

#[test]
fn a_hold_of_an_earlier_session_names_no_command() {
    let mut bench = Bench::seeking();
    bench.run_with_ball(20, BALL);
    assert_eq!(bench.send(Command::Hold), Ok(()));
    assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
    bench.sequence = 0;
    bench.run_with_ball(30, BALL);
    let telemetry = telemetry(&mut bench);
    assert_eq!((telemetry.state, telemetry.target), (State::Holding, None));
}

#[test]
fn telemetry_has_the_error_of_the_last_position_and_of_the_filtered_one() {
    let mut bench = Bench::seeking();
    let before = telemetry(&mut bench).filtered_error;
    let ball = [BALL[0] + 0.01, BALL[1], BALL[2]];
    bench.send_ball(ball);
    let after = telemetry(&mut bench);
    let error = [0, 1, 2].map(|i| ((ball[i] - TARGET[i]) * 1e6).round() as i32);
    assert_eq!(after.error.micrometres(), error);
    // A quarter of 10 mm along x, of which 0.14 / 0.388 is along e.
    let moved = after.filtered_error.0 - before.0;
    assert!((800..1_100).contains(&moved), "{moved} µm");
}

#[test]
fn pictures_outside_the_workspace_are_counted_anew_after_a_fault() {
    let mut bench = Bench::seeking();
    let outside = [3.5, 0.2, 0.2];
    for _ in 0..2 {
        let _ = bench.send_position(Some(outside), 0);
    }
    fail_driver(&mut bench);
    bench.run_ms(400);
    assert_eq!(bench.send(Command::ClearFault), Ok(()));
    let rate = Rate::from_si(100.0).unwrap();
    let jog = Jog { motor: 0, distance: Steps16(1_600), rate };
    assert_eq!(bench.send(Command::Jog(jog)), Ok(()));
    for _ in 0..2 {
        assert_eq!(bench.send_position(Some(outside), 0), Err(Refusal::BallOutside));
        assert_eq!(bench.harness.board.state(), State::Jogging);
    }
    assert_eq!(bench.send_position(Some(outside), 0), Err(Refusal::BallOutside));
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::BallOutside));
}

#[test]
fn the_border_of_the_workspace_is_inside() {
    let mut bench = Bench::seeking();
    let border = config().workspace.max.micrometres();
    let beyond = [border[0] + 1, border[1], border[2]];
    for (ball, answer) in [(border, Ok(())), (beyond, Err(Refusal::BallOutside))] {
        bench.sequence += 1;
        let position = Position {
            sequence: bench.sequence,
            age_us: 0,
            ball: Some(Point(ball.map(Micrometres))),
            covariance: None,
        };
        assert_eq!(bench.send(Command::Position(position)), answer);
    }
}
