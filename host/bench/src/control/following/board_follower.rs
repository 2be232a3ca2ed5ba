//! The board's own code as a follower, driven through encoded frames.

use nalgebra::Point3;
use plumb_emulator::{EMULATED, Harness, LawDelay};
use plumb_protocol::Wiring;
use plumb_protocol::message::{Command, Fault, FromBoard, Position, State};
use plumb_protocol::prior::Prior;
use plumb_protocol::units::{Micros, Point};
use plumb_protocol::{Config, PerMotor};

use super::course::Course;
use super::follower::{CourseFollower, Reading};

/// A board that follows a path. With each frame the host sends the path from the time on that the
/// board has reported.
pub(super) struct BoardFollower<'a> {
    harness: Harness,
    course: &'a Course,
    /// Number of the last position.
    position: u16,
    /// Number of the last message of the path.
    message: u16,
    /// Whether the ball has been seen: the board follows a ball that it knows.
    is_seen: bool,
    reading: Option<Reading>,
}

impl<'a> BoardFollower<'a> {
    /// Creates a board with this configuration and `prior`.
    pub(super) fn new(config: Config, prior: Option<Prior>, course: &'a Course) -> Self {
        let wiring = Wiring::example().of_motors(config.motors.len());
        let mut harness = Harness::configured(EMULATED, LawDelay::SameTick, wiring, config);
        if let Some(prior) = prior {
            harness.send(Micros(0), Command::Prior(prior));
        }
        Self { harness, course, position: 0, message: 0, is_seen: false, reading: None }
    }

    /// Takes in what the board has sent.
    fn read(&mut self) {
        for message in self.harness.take_messages() {
            if let Ok(FromBoard::Telemetry(telemetry)) = message
                && let Some(reference) = telemetry.reference
            {
                let at_s = telemetry.time.0 as f64 * 1e-6;
                self.reading = Some(Reading { at_s, path_s: Course::seconds(reference.time) });
            }
        }
    }
}

impl CourseFollower for BoardFollower<'_> {
    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.position = self.position.wrapping_add(1);
        let ball = ball.and_then(|ball| Point::from_metres(ball.into()));
        self.is_seen |= ball.is_some();
        let position = Position { sequence: self.position, age_us, ball, covariance: None };
        self.harness.send(now, Command::Position(position));
        self.message = self.message.wrapping_add(1);
        let path_s = self.reading.map_or(0.0, |reading| reading.path_s);
        if let Some(message) = self.course.message(self.message, path_s).filter(|_| self.is_seen) {
            self.harness.send(now, Command::Follow(message));
        }
        self.read();
    }

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        self.harness.tick(now);
        self.read();
        self.harness.motors()
    }

    fn reading(&self) -> Option<Reading> {
        self.reading
    }

    fn fault(&self) -> Option<Fault> {
        if let State::Fault(fault) = self.harness.board.state() { Some(fault) } else { None }
    }
}
