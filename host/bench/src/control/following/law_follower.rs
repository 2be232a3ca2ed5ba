//! A baseline in the board's servo as a follower.

use nalgebra::Point3;
use plumb_protocol::PerMotor;
use plumb_protocol::message::Fault;
use plumb_protocol::units::Micros;

use super::super::law_controller::LawController;
use super::super::simulate::Controller;
use super::course::Course;
use super::follower::{CourseFollower, Reading};

/// A law in the board's servo, which gets the path with each frame as a board does.
pub(super) struct LawFollower<'a> {
    controller: LawController,
    course: &'a Course,
    /// Number of the last message of the path.
    message: u16,
    is_seen: bool,
    reading: Option<Reading>,
}

impl<'a> LawFollower<'a> {
    /// Creates the follower from a controller whose target is the path's begin.
    pub(super) fn new(controller: LawController, course: &'a Course) -> Self {
        Self { controller, course, message: 0, is_seen: false, reading: None }
    }
}

impl CourseFollower for LawFollower<'_> {
    fn on_position(&mut self, now: Micros, age_us: u32, ball: Option<Point3<f64>>) {
        self.is_seen |= ball.is_some();
        self.controller.on_position(now, age_us, ball);
        self.message = self.message.wrapping_add(1);
        let path_s = self.reading.map_or(0.0, |reading| reading.path_s);
        if let Some(message) = self.course.message(self.message, path_s).filter(|_| self.is_seen) {
            self.controller.follow(now, &message);
        }
    }

    fn tick(&mut self, now: Micros) -> PerMotor<f64> {
        let motors = self.controller.tick(now);
        if let Some(state) = self.controller.reference(now) {
            let at_s = now.0 as f64 * 1e-6;
            self.reading = Some(Reading { at_s, path_s: Course::seconds(state.time) });
        }
        motors
    }

    fn reading(&self) -> Option<Reading> {
        self.reading
    }

    fn fault(&self) -> Option<Fault> {
        self.controller.fault()
    }
}
