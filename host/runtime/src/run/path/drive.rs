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

/// Drive along a path.
pub(crate) struct PathDrive {
    plan: PathPlan,
    phase: Phase,
    deviations: Deviations,
}

/// Progress of the drive.
enum Phase {
    /// The ball drives to the begin of the path.
    Waiting,
    Following(Following),
    /// The board holds the ball at the end of the path.
    Holding(Following),
    /// A command or a fault has ended the path.
    Cancelled(Option<Following>),
}

/// State of a path under way. Times are in seconds on the source's clock.
struct Following {
    last_sent: Option<f64>,
    clock: PathClock,
    /// Time of the first report.
    begin: Option<f64>,
    /// Time of the last progress, and the path's time then, seconds.
    progress: (f64, f64),
    /// Pace in the last report.
    pace: f64,
}

impl PathDrive {
    pub(crate) fn new(plan: PathPlan) -> Self {
        Self { plan, phase: Phase::Waiting, deviations: Deviations::default() }
    }

    fn trajectory(&self) -> &Trajectory {
        self.plan.trajectory()
    }

    /// Returns whether the path was not begun.
    pub(crate) fn is_waiting(&self) -> bool {
        matches!(self.phase, Phase::Waiting)
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

    /// Begins the path at the time `now`.
    pub(crate) fn begin(&mut self, now: f64) {
        self.phase = Phase::Following(Following {
            last_sent: None,
            clock: PathClock::default(),
            begin: None,
            progress: (now, 0.0),
            pace: 0.0,
        });
    }

    /// Ends the path: no message follows.
    pub(crate) fn cancel(&mut self) {
        let phase = std::mem::replace(&mut self.phase, Phase::Cancelled(None));
        if let Phase::Following(following) | Phase::Holding(following) = phase {
            self.phase = Phase::Cancelled(Some(following));
        }
    }

    /// Returns the next message, where it is due at `now`.
    pub(crate) fn next_message(&mut self, now: f64) -> Option<Reference> {
        let Phase::Following(following) = &mut self.phase else { return None };
        if following.last_sent.is_some_and(|last| now - last < LEAST_PERIOD_S) {
            return None;
        }
        following.last_sent = Some(now);
        let reported = following.clock.reported().unwrap_or(0.0);
        let present = following.clock.at(now).unwrap_or(reported);
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
            self.hold();
        }
        let Phase::Following(following) = &mut self.phase else { return };
        let Some(reference) = &telemetry.reference else { return };
        let [board, path] = [telemetry.time, reference.time].map(|time| time.0 as f64 * 1e-6);
        following.clock.update(Report { board, path }, sent);
        following.begin.get_or_insert(now);
        following.pace = f64::from(reference.pace) / 256.0;
        let path = path.min(self.plan.trajectory().duration());
        if path > following.progress.1 + PROGRESS_S {
            following.progress = (now, path);
        }
    }

    /// Ends the messages: the board holds the ball at the end.
    fn hold(&mut self) {
        self.phase = match std::mem::replace(&mut self.phase, Phase::Waiting) {
            Phase::Following(following) => Phase::Holding(following),
            other => other,
        };
    }

    /// Returns the time since the path's time last grew, seconds; `None` where the path is not
    /// under way.
    pub(crate) fn standstill(&self, now: f64) -> Option<f64> {
        match &self.phase {
            Phase::Following(following) | Phase::Holding(following) => {
                Some(now - following.progress.0)
            }
            Phase::Waiting | Phase::Cancelled(_) => None,
        }
    }

    /// Returns the point of the path at the time `time`, while the board follows it.
    pub(crate) fn point(&self, time: f64, state: Option<State>) -> Option<PathPoint> {
        let Phase::Following(following) = &self.phase else { return None };
        if state != Some(State::Following) {
            return None;
        }
        let path_time = following.clock.at(time)?;
        let moment = self.trajectory().at(path_time);
        Some(PathPoint {
            time: path_time.clamp(0.0, self.trajectory().duration()),
            pace: following.pace,
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
        let (Phase::Following(following)
        | Phase::Holding(following)
        | Phase::Cancelled(Some(following))) = &self.phase
        else {
            return None;
        };
        let (until, path_time) = following.progress;
        Some(self.deviations.summary(path_time, until - following.begin?))
    }
}
