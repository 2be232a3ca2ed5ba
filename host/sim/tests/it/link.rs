//! The link to an emulated board in memory.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use plumb_emulator::{EMULATED, EmulatedBoard};
use plumb_protocol::frame::encode;
use plumb_protocol::message::{Command, Fault, Hello, StartCause, State, ToBoard};
use plumb_protocol::units::{Acceleration, Micros, Milliseconds, Point};
use plumb_protocol::{Config, Wiring};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;
use plumb_runtime::run::{Run, RunError};
use plumb_sim::memory::Memory;

/// A configuration under which the motors follow a stop late and slowly.
fn smoothed() -> Config {
    let mut config = Rig::paper().unwrap().config().unwrap();
    config.mean = Milliseconds(400);
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(40));
    config
}

fn memory() -> (Rc<RefCell<EmulatedBoard>>, Link<Memory>) {
    let board = Rc::new(RefCell::new(EmulatedBoard::new(EMULATED)));
    let link = Link::connect(Memory::new(Rc::clone(&board))).unwrap();
    (board, link)
}

/// Reports the ball, and lets `span_us` of the board's time pass.
fn see(board: &RefCell<EmulatedBoard>, link: &mut Link<Memory>, ball: Point, span_us: u64) {
    link.position(Some(ball), None, Duration::ZERO).unwrap();
    let now = board.borrow().now().0;
    board.borrow_mut().run_to(Micros(now + span_us)).unwrap();
}

/// The target, and a ball 20 cm above it.
fn target_and_ball() -> (Point, Point) {
    let target = Rig::paper().unwrap().targets().unwrap()[0];
    let [x, y, z] = target.to_metres();
    (target, Point::from_metres([x, y, z + 0.2]).unwrap())
}

#[test]
fn a_board_whose_motors_still_turn_is_configured_once_they_rest() {
    let (target, ball) = target_and_ball();
    for phase in 0..100 {
        let (board, mut link) = memory();
        link.configure(Wiring::example(), smoothed()).unwrap();
        link.set_target(target).unwrap();
        for _ in 0..10 {
            see(&board, &mut link, ball, 33_000);
        }
        see(&board, &mut link, ball, 200 * phase);
        // Another host takes over.
        let mut link = Link::connect(Memory::new(Rc::clone(&board))).unwrap();
        let configured = link.configure(Wiring::example(), smoothed());
        assert!(configured.is_ok(), "after {phase} ticks: {configured:?}");
    }
}

#[test]
fn a_target_that_is_refused_for_a_fault_is_not_reported_as_set() {
    let (target, _) = target_and_ball();
    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    link.set_target(target).unwrap();
    // Nobody speaks to the board: it stops by itself.
    let now = board.borrow().now().0;
    board.borrow_mut().run_to(Micros(now + 3_000_000)).unwrap();
    let again = link.set_target(target);
    assert!(matches!(again, Err(LinkError::Fault(_))), "{again:?}");
}

#[test]
fn a_board_without_a_configuration_reports_that() {
    let (_, mut link) = memory();
    let telemetry = link.status().unwrap();
    assert_eq!((telemetry.state, telemetry.configuration), (State::Unconfigured, None));
}

#[test]
fn the_numbers_of_requests_may_wrap_in_a_long_run() {
    let (target, _) = target_and_ball();
    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    link.set_target(target).unwrap();
    for _ in 0..70_000 {
        see(&board, &mut link, target, 1_000);
        link.poll().unwrap();
        assert!(link.target_telemetry().is_some());
    }
    link.set_target(target).unwrap();
    assert_eq!(link.refused_positions(), 0);
    // Among their numbers is that of a target.
    for _ in 0..70_000 {
        link.position(None, None, Duration::MAX).unwrap();
        let now = board.borrow().now().0;
        board.borrow_mut().run_to(Micros(now + 1_000)).unwrap();
        if link.fault().is_some() {
            break;
        }
        link.poll().unwrap();
    }
    assert_eq!(link.fault(), Some(Fault::PositionLost));
}

#[test]
fn a_host_that_was_suspended_for_minutes_finds_the_fault() {
    let (target, ball) = target_and_ball();
    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    // Each time anew: a second fault is not hidden by the first, nor the other way round.
    for _ in 0..2 {
        assert_eq!(link.fault(), None);
        link.set_target(target).unwrap();
        for _ in 0..30 {
            see(&board, &mut link, ball, 33_000);
            link.poll().unwrap();
        }
        see(&board, &mut link, ball, 300_000_000);
        see(&board, &mut link, ball, 1_000);
        link.poll().unwrap();
        assert_eq!(link.fault(), Some(Fault::HostSilent));
        assert!(link.target_telemetry().is_none());
        link.clear_fault().unwrap();
        link.configure(Wiring::example(), smoothed()).unwrap();
    }
}

#[test]
fn a_fault_that_a_host_left_behind_is_cleared_only_on_request() {
    let (target, ball) = target_and_ball();
    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    link.set_target(target).unwrap();
    see(&board, &mut link, ball, 3_000_000);
    let fault = State::Fault(Fault::HostSilent);
    assert_eq!(board.borrow().state(), fault);
    let mut link = Link::connect(Memory::new(Rc::clone(&board))).unwrap();
    let refused = link.configure(Wiring::example(), smoothed()).unwrap_err();
    assert!(matches!(refused, LinkError::Faulted { fault: Fault::HostSilent, .. }), "{refused:?}");
    let message = refused.to_string();
    for part in ["nothing came from the host", "overloaded or asleep", "Nothing has moved"] {
        assert!(message.contains(part), "{message}");
    }
    assert_eq!(board.borrow().state(), fault);
    link.clear_fault().unwrap();
    link.configure(Wiring::example(), smoothed()).unwrap();
    assert_eq!(board.borrow().state(), State::Ready);
}

/// Returns a new run on `board`, and the board's state after its connection.
fn next_run(board: &Rc<RefCell<EmulatedBoard>>) -> (Result<Run<Memory>, RunError>, State) {
    let run = Run::connect(&Rig::paper().unwrap(), Memory::new(Rc::clone(board)));
    (run, board.borrow().state())
}

#[test]
fn a_new_run_clears_no_fault_but_that_of_a_silent_host() {
    let (target, ball) = target_and_ball();
    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    link.set_target(target).unwrap();
    see(&board, &mut link, ball, 3_000_000);
    let (run, state) = next_run(&board);
    assert_eq!(run.unwrap().cleared_fault(), Some(Fault::HostSilent));
    assert_eq!(state, State::Ready);
    let (run, _) = next_run(&board);
    assert_eq!(run.unwrap().cleared_fault(), None);

    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    link.set_target(target).unwrap();
    see(&board, &mut link, ball, 33_000);
    // The host speaks, and sees no ball.
    for _ in 0..100 {
        let now = board.borrow().now().0;
        board.borrow_mut().run_to(Micros(now + 33_000)).unwrap();
        link.status().unwrap();
    }
    let (run, state) = next_run(&board);
    let Err(RunError::Connect(LinkError::Faulted { fault, .. })) = run else {
        panic!("the run did not refuse the fault");
    };
    assert_eq!(fault, Fault::PositionLost);
    assert_eq!(state, State::Fault(Fault::PositionLost));
}

/// Configures a board, and drives it until it does not know this session any more. `end` ends the
/// session after 2 s. Returns the error.
fn lose_session(end: impl Fn(&mut EmulatedBoard)) -> LinkError {
    let (target, ball) = target_and_ball();
    let (board, mut link) = memory();
    link.configure(Wiring::example(), smoothed()).unwrap();
    link.set_target(target).unwrap();
    for frame in 0..100 {
        if frame == 60 {
            end(&mut board.borrow_mut());
        }
        see(&board, &mut link, ball, 33_000);
        if let Err(error) = link.poll() {
            return error;
        }
    }
    panic!("the session goes on");
}

#[test]
fn a_greeting_of_another_version_is_not_told_as_a_restart() {
    let hello = Hello { version: Hello::OURS.version + 1, ..Hello::OURS };
    let greeting = encode(&ToBoard { id: 1, command: Command::Hello(hello) }).unwrap();
    let error = lose_session(|board| board.write(&greeting));
    assert!(matches!(error, LinkError::OtherProgram { .. }), "{error}");
    let error = lose_session(|board| board.restart(StartCause::ResetPin));
    assert!(
        matches!(error, LinkError::Restarted { cause: Some(StartCause::ResetPin), .. }),
        "{error}"
    );
}
