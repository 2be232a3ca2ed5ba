//! Repeated requests, requests to a busy board, and the ids in telemetry.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use plumb_core::board::FlashTask;
use plumb_protocol::Config;
use plumb_protocol::frame::encode;
use plumb_protocol::message::*;
use plumb_protocol::units::{Micros, Rate, Steps16};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{BUILD, config, motor};

fn jog(motor: u8, steps: i32, rate: i32) -> Command {
    Command::Jog(Jog { motor, distance: Steps16(16 * steps), rate: Rate(256 * rate) })
}

/// Returns ids and refusals of the answers since the last call.
fn answered(bench: &mut Bench) -> Vec<(u16, Option<Refusal>)> {
    bench.collect();
    let answer = |m| match m {
        FromBoard::Answer(answer) => Some((answer.id, answer.refusal)),
        _ => None,
    };
    bench.received.drain(..).filter_map(answer).collect()
}

fn telemetry(bench: &mut Bench) -> Telemetry {
    bench.received.clear();
    let _ = bench.send(Command::Status);
    let telemetry = bench.received.iter().find_map(|m| match m {
        FromBoard::Telemetry(telemetry) => Some(*telemetry),
        _ => None,
    });
    telemetry.unwrap()
}

#[test]
fn a_repeated_jog_moves_once_and_is_answered_each_time() {
    let mut bench = Bench::configured(config());
    for _ in 0..3 {
        assert_eq!(bench.send_as(100, jog(0, 10, 100)), Ok(()));
        bench.run_ms(100);
    }
    bench.run_ms(100);
    assert_eq!(bench.send_as(100, jog(0, 10, 100)), Ok(()));
    bench.run_ms(200);
    assert_eq!(bench.harness.board.positions(), [160, 0, 0]);
    // Another id makes another jog, and so does other content.
    assert_eq!(bench.send_as(101, jog(0, 10, 100)), Ok(()));
    bench.run_ms(250);
    assert_eq!(bench.harness.board.positions(), [320, 0, 0]);
    assert_eq!(bench.send_as(101, jog(0, -20, 100)), Ok(()));
    bench.run_ms(290);
    assert_eq!(bench.harness.board.positions(), [0, 0, 0]);
}

#[test]
fn a_repeated_clear_fault_does_not_clear_a_later_fault() {
    let mut bench = Bench::seeking();
    bench.run_ms(600);
    assert_eq!(bench.send_as(100, Command::ClearFault), Ok(()));
    bench.harness.on_emergency_stop(Micros(bench.now), [0; 3]);
    bench.run_ms(10);
    assert_eq!(bench.send_as(100, Command::ClearFault), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
    assert_eq!(bench.send_as(101, Command::ClearFault), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Ready);
}

#[test]
fn a_repeated_target_is_not_set_again_and_a_refused_one_is_tried_again() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.send(jog(0, 10, 100)), Ok(()));
    assert_eq!(
        bench.send_as(100, Command::Target(point(TARGET))),
        Err(Refusal::Busy(State::Jogging))
    );
    bench.run_ms(290);
    assert_eq!(bench.send_as(100, Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(60, TARGET);
    assert_eq!(bench.harness.board.state(), State::Holding);
    assert_eq!(bench.send_as(100, Command::Target(point(TARGET))), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Holding);
    assert_eq!(bench.send_as(101, Command::Target(point(TARGET))), Ok(()));
    assert_eq!(bench.harness.board.state(), State::Seeking);
}

#[test]
fn a_new_session_may_begin_with_the_ids_of_the_last() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.send_as(3, jog(0, 10, 100)), Ok(()));
    bench.run_ms(290);
    let _ = bench.send_as(1, Command::Hello(Hello::OURS));
    assert_eq!(bench.send_as(3, jog(0, 10, 100)), Ok(()));
    bench.run_ms(290);
    assert_eq!(bench.harness.board.positions(), [320, 0, 0]);
}

#[test]
fn telemetry_names_its_configuration_and_target() {
    let mut bench = Bench::greeted(BUILD);
    assert_eq!(telemetry(&mut bench).configuration, None);
    assert_eq!(bench.send_as(200, Command::Configure(config())), Ok(()));
    bench.run_with_ball(5, BALL);
    let idle = telemetry(&mut bench);
    assert_eq!((idle.configuration, idle.target), (Some(200), None));
    assert_eq!(bench.send_as(201, Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(60, TARGET);
    let first = telemetry(&mut bench);
    assert_eq!((first.state, first.target), (State::Holding, Some(201)));
    assert_eq!(bench.send_as(202, Command::Target(point(BALL))), Ok(()));
    let second = telemetry(&mut bench);
    assert_eq!((second.state, second.target), (State::Seeking, Some(202)));
    assert_eq!(bench.send_as(203, Command::Hold), Ok(()));
    assert_eq!(telemetry(&mut bench).target, Some(203));
    // A new session forgets both ids.
    let _ = bench.send(Command::Hello(Hello::OURS));
    let other = telemetry(&mut bench);
    assert_eq!((other.configuration, other.target), (None, None));
}

#[test]
fn a_fault_names_its_configuration_and_an_answer_its_time() {
    let mut bench = Bench::greeted(BUILD);
    assert_eq!(bench.send_as(200, Command::Configure(config())), Ok(()));
    bench.run_ms(7);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    let Some(FromBoard::Answer(answer)) = bench.received.last() else {
        panic!("{:?}", bench.received)
    };
    assert_eq!(answer.time, Micros(bench.now));
    bench.run_ms(400);
    let report = bench.received.iter().find_map(|m| match m {
        FromBoard::Fault(report) => Some(*report),
        _ => None,
    });
    let report = report.unwrap();
    assert_eq!((report.fault, report.configuration), (Fault::HostSilent, Some(200)));
}

#[test]
fn nothing_begins_after_the_bootloader_command() {
    let mut bench = Bench::seeking();
    assert_eq!(bench.send(Command::Bootloader), Ok(()));
    let begun = [
        Command::Target(point(TARGET)),
        Command::Hold,
        jog(0, 1, 1),
        Command::Configure(config()),
        Command::Store,
    ];
    for command in begun {
        assert_eq!(bench.send(command), Err(Refusal::Busy(State::Stopping)), "{command:?}");
    }
    bench.run_with_ball(10, BALL);
    assert!(bench.outputs.bootloader && !bench.moving());
    for command in begun {
        assert_eq!(bench.send(command), Err(Refusal::Busy(State::Stopping)), "{command:?}");
    }
}

#[test]
fn every_store_is_answered_and_a_configuration_is_refused_meanwhile() {
    let mut bench = Bench::configured(config());
    bench.received.clear();
    let other = Config { microsteps: 8, ..config() };
    let requests = [
        (11, Command::Store),
        (11, Command::Store),
        (12, Command::Store),
        (13, Command::Configure(other)),
        (14, Command::Hold),
    ];
    for (id, command) in requests {
        let frame = encode(&ToBoard { id, command }).unwrap();
        bench.harness.receive(Micros(bench.now), &frame);
    }
    let busy = Some(Refusal::Busy(State::Storing));
    assert_eq!(answered(&mut bench), [(12, busy), (13, busy), (14, busy)]);
    assert_eq!(bench.tick().flash, Some(FlashTask::Store));
    bench.harness.on_stored(Micros(bench.now), true);
    assert_eq!(answered(&mut bench), [(11, None)]);
    assert_eq!(bench.tick().flash, None);
    // A repeated Store is answered without another write.
    assert_eq!(bench.send_as(11, Command::Store), Ok(()));
    assert_eq!(bench.tick().flash, None);
    assert_eq!(bench.send_as(13, Command::Configure(other)), Ok(()));
}

#[test]
fn a_hold_is_refused_during_a_jog() {
    let mut bench = Bench::configured(config());
    bench.run_with_ball(5, BALL);
    assert_eq!(bench.send(jog(0, 100, 100)), Ok(()));
    bench.run_ms(50);
    assert_eq!(bench.send(Command::Hold), Err(Refusal::Busy(State::Jogging)));
}

#[test]
fn a_motor_outside_its_travel_only_comes_back_and_slowly() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.send(jog(1, 60, 400)), Ok(()));
    for _ in 0..5 {
        bench.run_ms(100);
        let _ = bench.send(Command::Status);
    }
    assert_eq!(bench.harness.board.positions(), [0, 960, 0]);
    let motors = [motor(400.0, 2000, 16 * 50); 3];
    assert_eq!(
        bench.send(Command::Configure(Config { motors: motors.into(), ..config() })),
        Ok(())
    );
    bench.run_with_ball(5, BALL);
    for command in [Command::Target(point(TARGET)), Command::Hold] {
        assert_eq!(bench.send(command), Err(Refusal::OutsideTravel(1)));
    }
    assert_eq!(bench.send(jog(1, 1, 10)), Err(Refusal::JogTravel));
    assert_eq!(bench.send(jog(1, -120, 400)), Err(Refusal::JogTravel));
    assert_eq!(bench.send(jog(1, -10, 400)), Ok(()));
    for _ in 0..8 {
        bench.run_ms(100);
        let _ = bench.send(Command::Status);
        assert!(bench.harness.board.rates()[1].abs() <= 20 * 256);
    }
    assert_eq!(bench.harness.board.positions(), [0, 800, 0]);
    bench.run_with_ball(1, BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
}
