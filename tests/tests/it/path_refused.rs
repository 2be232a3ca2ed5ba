//! What the link tells of a path that the board refuses, or does not answer. In virtual time.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::time::Duration;

use nalgebra::{Point3, Vector3};
use plumb_path::trajectory::Moment;
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::{Command, Fault, Reference, Refusal, StartCause, State, ToBoard};
use plumb_protocol::units::{Micros, Point};
use plumb_runtime::link::{Link, LinkError, Transport};
use plumb_runtime::reference::reference;
use plumb_runtime::rig::Rig;
use plumb_sim::memory::Memory;
use plumb_sim::simulated::VirtualBoard;

/// Time between two pictures, µs.
const PERIOD_US: u64 = 33_333;

/// Place outside the workspace of the paper's rig file, m.
const OUTSIDE: Point3<f64> = Point3::new(0.5, 0.3, 0.9);

/// Host with a link to an emulated board, whose ball it sees.
struct Host<T> {
    board: VirtualBoard,
    link: Link<T>,
}

impl<T: Transport> Host<T> {
    /// Connects to a new board through `wrap`, without a configuration.
    fn connected(wrap: impl FnOnce(Memory) -> T) -> Self {
        let board = VirtualBoard::paper().expect("the paper's rig");
        let link = Link::connect(wrap(board.transport())).expect("a board that answers");
        Self { board, link }
    }

    /// Connects to a new board and configures it by the paper's rig file.
    fn configured(wrap: impl FnOnce(Memory) -> T) -> Self {
        let mut host = Self::connected(wrap);
        let rig = Rig::paper().expect("the paper's rig file");
        let (wiring, config) = (rig.wiring(), rig.config().expect("a valid rig file"));
        let wiring = wiring.expect("a valid rig file");
        host.link.configure(wiring, config).expect("a board that accepts it");
        host
    }

    fn ball(&self) -> Point3<f64> {
        self.board.board().borrow().ball().expect("a rig with a ball")
    }

    fn state(&self) -> State {
        self.board.board().borrow().state()
    }

    /// Sends the position of the ball, and lets a picture's time pass. Returns what the link tells.
    fn look(&mut self) -> Result<(), LinkError> {
        let ball = Point::from_metres(self.ball().into());
        self.link.position(ball, None, Duration::from_millis(20))?;
        let end = Micros(self.board.board().borrow().now().0 + PERIOD_US);
        self.board.board().borrow_mut().run_to(end).expect("a rig that follows");
        self.link.poll()
    }

    /// Sends a path that begins at rest at the ball and goes to `end` in 0.15 s.
    fn follow(&mut self, end: Point3<f64>) {
        let sent = self.link.follow(path(self.ball(), end));
        sent.expect("a link that is there");
    }

    /// Looks until the link tells something. Returns that, and the time until then.
    fn failure(&mut self) -> (LinkError, Duration) {
        for frame in 1..200 {
            if let Err(error) = self.look() {
                return (error, Duration::from_micros(frame * PERIOD_US));
            }
        }
        panic!("the link tells nothing of the path")
    }
}

/// Returns a path from rest at `begin` to rest at `end`, m, 0.15 s later. The link numbers it.
fn path(begin: Point3<f64>, end: Point3<f64>) -> Reference {
    let place = |time: f64| if time > 0.0 { end } else { begin };
    reference(0, true, 0.0, 0.0, |time| Moment::resting(place(time)))
}

/// Returns the refusal of the path that an error tells.
fn refusal((error, _): (LinkError, Duration)) -> Refusal {
    match error {
        LinkError::Refused { what: "the path", refusal } => refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_path_that_leaves_the_workspace_is_refused_and_moves_nothing() {
    let mut host = Host::configured(|link| link);
    host.look().expect("a board that is ready");
    let ball = host.ball();
    host.follow(OUTSIDE);
    assert_eq!(refusal(host.failure()), Refusal::ReferenceOutside);
    assert_eq!((host.state(), host.ball()), (State::Ready, ball));
}

#[test]
fn a_path_beyond_the_ranges_of_the_wire_is_refused() {
    let mut host = Host::configured(|link| link);
    host.look().expect("a board that is ready");
    let reference = path(host.ball(), host.ball());
    host.link.follow(Reference { interval_us: 1, ..reference }).expect("a link that is there");
    assert_eq!(refusal(host.failure()), Refusal::ReferenceRange);
    assert_eq!(host.state(), State::Ready);
}

#[test]
fn a_board_without_a_configuration_or_a_position_refuses_a_path() {
    let mut host = Host::connected(|link| link);
    host.follow(host.ball());
    assert_eq!(refusal(host.failure()), Refusal::Unconfigured);
    let mut host = Host::configured(|link| link);
    host.follow(host.ball());
    assert_eq!(refusal(host.failure()), Refusal::NoPosition);
    assert_eq!(host.state(), State::Ready);
}

#[test]
fn a_path_that_leaves_the_workspace_under_way_is_told_as_the_fault_that_stopped_the_board() {
    let mut host = Host::configured(|link| link);
    host.look().expect("a board that is ready");
    let towards = host.ball() + Vector3::new(0.0, 0.02, 0.0);
    host.follow(towards);
    host.look().expect("a path that goes on");
    assert_eq!(host.state(), State::Following);
    host.follow(OUTSIDE);
    for _ in 0..20 {
        host.look().expect("the fault is the cause, and no refusal");
    }
    assert_eq!(host.link.fault(), Some(Fault::TargetOutside));
    assert_eq!(host.state(), State::Fault(Fault::TargetOutside));
    // Another path is refused for the same cause.
    host.follow(towards);
    host.look().expect("the fault is the cause, and no refusal");
    assert_eq!(host.link.fault(), Some(Fault::TargetOutside));
}

/// Without pictures, only messages of the path show that the board has lost its session.
#[test]
fn a_restart_under_way_is_told_as_one_and_not_as_a_refused_path() {
    let mut host = Host::configured(|link| link);
    host.look().expect("a board that is ready");
    host.follow(host.ball());
    host.look().expect("a path that goes on");
    host.board.board().borrow_mut().restart(StartCause::Watchdog);
    host.follow(host.ball());
    let end = Micros(host.board.board().borrow().now().0 + PERIOD_US);
    host.board.board().borrow_mut().run_to(end).expect("a rig that follows");
    let told = host.link.poll();
    assert!(matches!(told, Err(LinkError::Restarted { .. })), "{told:?}");
}

/// Transport that does something else than to send the messages of a path.
struct PathTransport<F> {
    inner: Memory,
    /// Sends the bytes of a message of a path.
    send_path: F,
}

impl<F> Transport for PathTransport<F>
where
    F: FnMut(&mut Memory, &[u8]) -> Result<(), LinkError>,
{
    fn name(&self) -> String {
        self.inner.name()
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let mut accumulator = Accumulator::new();
        let mut messages = bytes.iter().filter_map(|byte| accumulator.push::<ToBoard>(*byte));
        let is_path = |message: &ToBoard| matches!(message.command, Command::Follow(_));
        if messages.any(|message| message.is_ok_and(|message| is_path(&message))) {
            return (self.send_path)(&mut self.inner, bytes);
        }
        self.inner.send(bytes)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        self.inner.receive(bytes, wait)
    }
}

#[test]
fn messages_that_newer_ones_overtake_and_that_come_twice_change_nothing() {
    let mut held: Option<Vec<u8>> = None;
    // Holds each second message back until the next one has been sent twice.
    let swap = |link: &mut Memory, bytes: &[u8]| match held.take() {
        None => {
            held = Some(bytes.to_vec());
            Ok(())
        }
        Some(older) => [bytes, bytes, &older].iter().try_for_each(|bytes| link.send(bytes)),
    };
    let mut host = Host::configured(|inner| PathTransport { inner, send_path: swap });
    host.look().expect("a board that is ready");
    let there = host.ball() + Vector3::new(0.0, 0.01, 0.0);
    let elsewhere = host.ball() - Vector3::new(0.0, 0.01, 0.0);
    for frame in 0..40 {
        let now = frame as f64 * 1e-6 * PERIOD_US as f64;
        // The message with the second place overtakes the one with the first.
        for place in [elsewhere, there] {
            let sent = host.link.follow(reference(0, true, now, now, |_| Moment::resting(place)));
            sent.expect("a link that is there");
        }
        host.look().expect("a path that goes on");
    }
    assert_eq!(host.state(), State::Following);
    let telemetry = host.link.path_telemetry().expect("telemetry of the path");
    let reference = telemetry.reference.expect("a reference").position.to_metres();
    assert!((Point3::from(reference) - there).norm() < 1e-3, "{reference:?}");
    assert_eq!(host.link.fault(), None);
}

#[test]
fn a_board_that_never_answers_a_path_is_told_as_silent_about_it_after_its_timeout() {
    let lose = |_: &mut Memory, _: &[u8]| Ok(());
    let mut host = Host::configured(|inner| PathTransport { inner, send_path: lose });
    host.look().expect("a board that is ready");
    host.follow(host.ball());
    let (error, after) = host.failure();
    assert!(matches!(error, LinkError::Silent { what: "the path", .. }), "{error:?}");
    assert!((1.5..1.6).contains(&after.as_secs_f64()), "{after:?}");
}
