//! Drive along a path: the messages to the board, and what it reports.

use nalgebra::Point3;
use plumb_path::trajectory::Trajectory;
use plumb_protocol::message::{Reference, State, Telemetry};
use plumb_protocol::units::Point;

use super::clock::{PathClock, Report};
use super::deviation::{Deviations, PathSummary};
use super::plan::PathPlan;
use crate::observer::PathPoint;
use crate::reference::{INTERVAL_S, reference};

/// Least time between two messages, seconds: one with each picture of a usual camera.
pub(in crate::run) const LEAST_PERIOD_S: f64 = 0.03;

/// Growth of the path's time that counts as progress, seconds.
const PROGRESS_S: f64 = 1e-3;

/// Drive along a path that was begun. Times are in seconds on the source's clock.
pub(crate) struct PathDrive {
    plan: PathPlan,
    last_sent: Option<f64>,
    clock: PathClock,
    /// Time of the first report.
    begin: Option<f64>,
    /// Time of the last progress, and the path's time then, seconds.
    progress: (f64, f64),
    /// Pace in the last report.
    pace: f64,
    /// Whether the board holds the ball at the end of the path.
    is_held: bool,
    deviations: Deviations,
}

impl PathDrive {
    /// Begins the path at the time `now`.
    pub(crate) fn new(plan: PathPlan, now: f64) -> Self {
        Self {
            plan,
            last_sent: None,
            clock: PathClock::default(),
            begin: None,
            progress: (now, 0.0),
            pace: 0.0,
            is_held: false,
            deviations: Deviations::default(),
        }
    }

    fn trajectory(&self) -> &Trajectory {
        self.plan.trajectory()
    }

    /// Returns whether the path is a loop.
    pub(crate) fn is_loop(&self) -> bool {
        self.trajectory().is_loop()
    }

    /// Returns the end of the path, of a loop its begin, metres, rounded to the board's unit.
    pub(crate) fn end(&self) -> [f64; 3] {
        let end = if self.is_loop() { 0.0 } else { self.trajectory().duration() };
        let end = self.trajectory().at(end).position.into();
        Point::from_metres(end).map_or(end, Point::to_metres)
    }

    /// Returns the next message, where it is due at `now`.
    pub(crate) fn next_message(&mut self, now: f64) -> Option<Reference> {
        let is_early = self.last_sent.is_some_and(|last| now - last < LEAST_PERIOD_S);
        if self.is_held || is_early {
            return None;
        }
        self.last_sent = Some(now);
        let reported = self.clock.reported().unwrap_or(0.0);
        let present = self.clock.at(now).unwrap_or(reported);
        Some(self.message(reported, present))
    }

    /// Returns the message with knots from before the `reported` time of the path on. All messages
    /// have their knots on the same grid of the path's time. The link gives it a number.
    fn message(&self, reported: f64, present: f64) -> Reference {
        let first = (reported / INTERVAL_S).floor() * INTERVAL_S;
        let motion = |time| self.trajectory().at(time);
        reference(0, self.plan.waits(), present, first, motion)
    }

    /// Takes in telemetry about the path that was received at `now`. The position that it names was
    /// sent at the time `sent`, where that is known.
    pub(crate) fn note_telemetry(&mut self, telemetry: &Telemetry, sent: Option<f64>, now: f64) {
        if telemetry.state == State::Holding {
            self.is_held = true;
        }
        if self.is_held {
            return;
        }
        let Some(reference) = &telemetry.reference else { return };
        let [board, path] = [telemetry.time, reference.time].map(|time| time.0 as f64 * 1e-6);
        self.clock.update(Report { board, path }, sent);
        self.begin.get_or_insert(now);
        self.pace = f64::from(reference.pace) / 256.0;
        let path = path.min(self.plan.trajectory().duration());
        if path > self.progress.1 + PROGRESS_S {
            self.progress = (now, path);
        }
    }

    /// Returns the time since the path's time last grew, seconds.
    pub(crate) fn standstill(&self, now: f64) -> f64 {
        now - self.progress.0
    }

    /// Returns the point of the path at the time `time`, while the board follows it.
    pub(crate) fn point(&self, time: f64, state: Option<State>) -> Option<PathPoint> {
        if self.is_held || state != Some(State::Following) {
            return None;
        }
        let path_time = self.clock.at(time)?;
        let moment = self.trajectory().at(path_time);
        Some(PathPoint {
            time: path_time.clamp(0.0, self.trajectory().duration()),
            pace: self.pace,
            position: moment.position,
            velocity: moment.velocity,
        })
    }

    /// Adds the deviation of a measured position, metres.
    pub(crate) fn note_position(&mut self, point: &PathPoint, position: Point3<f64>) {
        self.deviations.add(point, position);
    }

    /// Returns the summary; `None` where the board never followed the path.
    pub(crate) fn summary(&self) -> Option<PathSummary> {
        let (until, path_time) = self.progress;
        Some(self.deviations.summary(path_time, until - self.begin?))
    }
}
