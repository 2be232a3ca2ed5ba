//! A board that has the ball follow a path.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_protocol::config::{Estimated, Law};
use plumb_protocol::message::*;
use plumb_protocol::units::{Micros, Milliseconds, Point, Speed};
use plumb_protocol::wiring::{Drivers, StepDir};
use plumb_protocol::{Config, Wiring};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::config;

/// Zero of the path's time, µs.
const ZERO: u64 = 1_000_000;
/// Time between two knots, µs.
const INTERVAL: u32 = 150_000;
/// Speed along y, µm/s.
const SPEED: i32 = 50_000;
/// Time between two pictures, ms.
const FRAME_MS: u64 = 33;

/// Returns the place on a line along y at `time` (µs of the path), from [`BALL`] on.
fn place(time: u64) -> [f64; 3] {
    [BALL[0], BALL[1] + f64::from(SPEED) * 1e-12 * time.saturating_sub(ZERO) as f64, BALL[2]]
}

/// Returns the part of the line that begins before `time`. At `end` (µs) the path rests.
fn line(sequence: u16, time: u64, end: u64) -> Reference {
    let first = ZERO + (time - ZERO) / u64::from(INTERVAL) * u64::from(INTERVAL);
    let knot = |k: usize| {
        let at = first + k as u64 * u64::from(INTERVAL);
        let speed = if at < end { SPEED } else { 0 };
        Knot { position: point(place(at.min(end))), velocity: [0, speed, 0].map(Speed) }
    };
    Reference {
        sequence,
        now: Micros(time),
        waits: true,
        first: Micros(first),
        interval_us: INTERVAL,
        knots: std::array::from_fn(knot),
    }
}

/// A board that follows a line, and a ball that is where the reference is.
struct Line {
    bench: Bench,
    sequence: u16,
    end: u64,
    waits: bool,
    /// Positions of the reference in every tick, metres.
    references: Vec<[f64; 3]>,
    /// Where the ball is, off the reference, metres.
    off: f64,
}

impl Line {
    fn new(config: Config) -> Self {
        Self::with(Bench::configured(config))
    }

    fn with(mut bench: Bench) -> Self {
        bench.send_ball(BALL);
        Self { bench, sequence: 0, end: u64::MAX, waits: true, references: Vec::new(), off: 0.0 }
    }

    fn taut() -> Self {
        let law = Law::Taut(Estimated { delay: Milliseconds(0) });
        Self::new(Config { law, mean: Milliseconds(400), ..config() })
    }

    /// Returns the telemetry of the present.
    fn telemetry(&mut self) -> Telemetry {
        assert_eq!(self.bench.send(Command::Status), Ok(()));
        let telemetry = self.bench.received.iter().rev().find_map(|message| match message {
            FromBoard::Telemetry(telemetry) => Some(*telemetry),
            _ => None,
        });
        self.bench.received.clear();
        telemetry.unwrap()
    }

    /// Returns the state of the reference at present.
    fn reference(&mut self) -> ReferenceState {
        self.telemetry().reference.unwrap()
    }

    /// Sends the part of the path from `time` (µs) on.
    fn send(&mut self, time: u64) -> Result<(), Refusal> {
        self.sequence += 1;
        let reference = Reference { waits: self.waits, ..line(self.sequence, time, self.end) };
        self.bench.send(Command::Follow(reference))
    }

    /// Runs a frame time with the ball at the reference.
    fn run_frame(&mut self) {
        self.run_ticks();
        let mut ball = self.references.last().copied().unwrap();
        ball[2] += self.off;
        self.bench.send_ball(ball);
    }

    /// Runs the ticks of a frame time, while the board follows.
    fn run_ticks(&mut self) {
        for _ in 0..FRAME_MS * 5 {
            if self.bench.harness.board.state() != State::Following {
                return;
            }
            let reference = self.reference();
            self.references.push(reference.position.to_metres());
            self.bench.tick();
        }
    }

    /// Follows for `frames` pictures, with a message after each.
    fn follow(&mut self, frames: u32) {
        for _ in 0..frames {
            let time = if self.bench.harness.board.state() == State::Following {
                self.reference().time.0
            } else {
                ZERO
            };
            assert_eq!(self.send(time), Ok(()));
            self.run_frame();
        }
    }

    /// Follows for this time, ms, while pictures come without the ball.
    fn lose_ball(&mut self, time_ms: u64) {
        for _ in 0..time_ms / FRAME_MS {
            if self.bench.harness.board.state() == State::Following {
                let time = self.reference().time.0;
                let _ = self.send(time);
                let _ = self.bench.send_position(None, 30_000);
                self.run_ticks();
            }
        }
    }

    /// Checks that the reference kept to its limits all the time: positions are known to 1 µm.
    fn check_limits(&self) {
        // Over 16 ms, the step of the reference.
        let moved = |k: usize| (self.references[k + 80][1] - self.references[k][1]) / 0.016;
        for k in 0..self.references.len() - 160 {
            assert!(moved(k).abs() < 0.3, "{k}: {} m/s", moved(k));
            let acceleration = (moved(k + 80) - moved(k)) / 0.016;
            assert!(acceleration.abs() < 1.1, "{k}: {acceleration} m/s²");
        }
    }
}

#[test]
fn the_reference_starts_at_the_ball_and_keeps_the_paths_speed() {
    for mut line in [Line::new(config()), Line::taut()] {
        line.follow(90);
        assert_eq!(line.bench.harness.board.state(), State::Following);
        let first = line.references[0];
        assert!((0..3).all(|i| (first[i] - BALL[i]).abs() < 1e-4), "{first:?}");
        let reference = line.reference();
        assert_eq!(reference.pace, 256);
        let expected = place(reference.time.0);
        let at = reference.position.to_metres();
        assert!((0..3).all(|i| (at[i] - expected[i]).abs() < 1e-4), "{at:?} {expected:?}");
        line.check_limits();
    }
}

/// A DM542 takes no pulses for 200 ms after ENABLE.
#[test]
fn a_path_that_waits_begins_once_the_drivers_take_pulses() {
    let drivers = Drivers::StepDir(StepDir { enable: Milliseconds(200), ..StepDir::A4988 });
    let mut line = Line::with(Bench::wired(Wiring::pico(drivers), config()));
    line.follow(5);
    let at = line.reference().position.to_metres();
    assert!((0..3).all(|i| (at[i] - BALL[i]).abs() < 1e-4), "after 165 ms: {at:?}");
    line.follow(60);
    assert_eq!(line.reference().pace, 256);
    line.check_limits();
}

#[test]
fn a_path_that_ceases_ramps_to_rest_and_goes_on_without_a_jump() {
    let mut line = Line::taut();
    line.follow(60);
    // The last knot of the last message.
    let last = line.reference().time.0 + 6 * u64::from(INTERVAL);
    (0..60).for_each(|_| line.run_frame());
    let reference = line.reference();
    assert!(reference.pace < 8 && reference.time.0 <= last, "{reference:?}");
    assert_eq!(line.bench.harness.board.state(), State::Following);
    let rest = line.reference().position;
    line.run_frame();
    assert!(line.reference().position.0[1].0 - rest.0[1].0 < 100);
    line.follow(60);
    assert_eq!(line.reference().pace, 256);
    line.check_limits();
}

#[test]
fn a_path_waits_for_a_ball_that_stays_behind_and_for_one_that_is_not_seen() {
    let mut line = Line::new(config());
    line.follow(60);
    line.off = -0.03;
    line.follow(40);
    assert_eq!(line.reference().pace, 0);
    line.off = 0.0;
    line.follow(40);
    assert_eq!(line.reference().pace, 256);
    line.lose_ball(330);
    assert!(line.reference().pace < 250);
    line.follow(40);
    assert_eq!(line.bench.harness.board.state(), State::Following);
    assert_eq!(line.reference().pace, 256);
    line.check_limits();
}

#[test]
fn a_ball_that_is_not_seen_for_two_seconds_stops_the_motors_and_not_the_drive() {
    for mut line in [Line::new(config()), Line::taut()] {
        line.follow(60);
        line.lose_ball(2000);
        assert_eq!(line.bench.harness.board.state(), State::Following);
        assert_eq!(line.bench.harness.board.rates(), [0; 3]);
        let rests = line.reference();
        line.lose_ball(100);
        assert_eq!(line.reference().position, rests.position);
        line.follow(60);
        assert_eq!(line.reference().pace, 256);
        line.check_limits();
        line.lose_ball(2600);
        assert_eq!(line.bench.harness.board.state(), State::Fault(Fault::PositionLost));
    }
}

#[test]
fn a_path_that_goes_on_does_not_wait_and_holds_to_its_own_time() {
    let mut line = Line::new(config());
    line.waits = false;
    line.off = -0.015;
    let began = line.bench.now;
    for frame in 0..120 {
        let time = ZERO + line.bench.now - began;
        // Messages are up to 60 ms late, and every tenth is lost.
        let late = [0, 20_000, 60_000, 5_000][frame % 4];
        if frame % 10 != 3 {
            assert_eq!(line.send(time.saturating_sub(late).max(ZERO)), Ok(()));
        }
        line.run_frame();
    }
    let (time, reference) = (ZERO + line.bench.now - began, line.reference());
    assert!(reference.time.0.abs_diff(time) < 30_000, "{reference:?} at {time}");
    line.check_limits();
}

#[test]
fn a_path_ends_with_the_ball_held_at_its_end() {
    let mut line = Line::taut();
    line.end = ZERO + 2_000_000;
    for _ in 0..150 {
        if line.bench.harness.board.state() != State::Holding {
            line.follow(1);
        }
    }
    assert_eq!(line.bench.harness.board.state(), State::Holding);
    // The ball that the test reports is where the reference was last.
    let last = line.references.last().unwrap()[1];
    assert!((last - place(line.end)[1]).abs() < 5e-4);
    // The board holds the ball at the last knot.
    line.bench.send_ball(place(line.end));
    assert_eq!(line.telemetry().error, Point::default());
}

#[test]
fn a_path_from_a_held_target_begins_there_and_not_at_the_ball() {
    let mut line = Line::new(config());
    let near = [BALL[0], BALL[1], BALL[2] + 0.004];
    assert_eq!(line.bench.send(Command::Target(point(near))), Ok(()));
    line.bench.run_with_ball(20, BALL);
    assert_eq!(line.bench.harness.board.state(), State::Holding);
    assert_eq!(line.send(ZERO), Ok(()));
    assert_eq!(line.reference().position, point(near));
}

#[test]
fn references_are_checked_and_only_the_newest_counts() {
    let mut line = Line::new(config());
    let good = line_at_start(9);
    let [mut short, mut long] = [good; 2];
    (short.interval_us, long.interval_us) = (9_999, 500_001);
    let fast = with_knot(good, |k| k.velocity[1].0 = 2_000_001);
    for wrong in [short, long, fast] {
        assert_eq!(line.bench.send(Command::Follow(wrong)), Err(Refusal::ReferenceRange));
    }
    let outside = with_knot(good, |k| k.position = point([0.5, 0.2, 0.601]));
    assert_eq!(line.bench.send(Command::Follow(outside)), Err(Refusal::ReferenceOutside));
    assert_eq!(line.bench.harness.board.state(), State::Ready);
    assert_eq!(line.bench.send(Command::Follow(good)), Ok(()));
    for sequence in [9, 8, 9 + (1 << 15)] {
        let old = Reference { sequence, ..good };
        assert_eq!(line.bench.send(Command::Follow(old)), Err(Refusal::ReferenceOutOfOrder));
    }
    assert_eq!(line.bench.send(Command::Follow(line_at_start(10))), Ok(()));
    // A board that moves stops for a path that leaves the workspace, as for such a target.
    let outside = Reference { sequence: 11, ..outside };
    assert_eq!(line.bench.send(Command::Follow(outside)), Err(Refusal::ReferenceOutside));
    assert_eq!(line.bench.harness.board.state(), State::Fault(Fault::TargetOutside));
}

#[test]
fn following_needs_a_ball_and_ends_with_a_target_or_a_stop() {
    let mut bench = Bench::configured(config());
    let follow = Command::Follow(line_at_start(1));
    assert_eq!(bench.send(follow), Err(Refusal::NoPosition));
    let mut line = Line::new(config());
    line.follow(30);
    assert_eq!(line.bench.send(Command::Target(point(TARGET))), Ok(()));
    assert_eq!(line.bench.harness.board.state(), State::Seeking);
    assert_eq!(line.bench.send(Command::Follow(line_at_start(1000))), Ok(()));
    assert_eq!(line.bench.harness.board.state(), State::Following);
    assert_eq!(line.bench.send(Command::Stop), Ok(()));
    line.bench.run_ms(1000);
    assert_eq!(line.bench.harness.board.state(), State::Ready);
}

/// Returns the first part of the line.
fn line_at_start(sequence: u16) -> Reference {
    line(sequence, ZERO, u64::MAX)
}

/// Returns a reference with a change of its last knot.
fn with_knot(mut reference: Reference, change: impl FnOnce(&mut Knot)) -> Reference {
    change(&mut reference.knots[KNOTS - 1]);
    reference
}

#[test]
fn a_jump_of_the_path_is_no_jump_of_the_reference() {
    let mut line = Line::taut();
    line.waits = false;
    line.follow(60);
    let time = line.reference().time.0;
    // 10 cm further, at once.
    for _ in 0..60 {
        line.sequence += 1;
        let now = line.reference().time.0.max(time);
        let mut reference = Reference { waits: false, ..line_at(line.sequence, now) };
        reference.knots.iter_mut().for_each(|knot| knot.position.0[1].0 += 100_000);
        assert_eq!(line.bench.send(Command::Follow(reference)), Ok(()));
        line.run_frame();
    }
    line.check_limits();
    let reference = line.reference();
    let expected = place(reference.time.0)[1] + 0.1;
    assert!((Point(reference.position.0).to_metres()[1] - expected).abs() < 1e-3);
}

/// Returns the part of the line from `time` on.
fn line_at(sequence: u16, time: u64) -> Reference {
    line(sequence, time, u64::MAX)
}
