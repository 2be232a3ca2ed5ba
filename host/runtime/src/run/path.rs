//! A path that the ball follows: its check, the messages to the board, and how well the ball
//! follows.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};
use plumb_path::check::{Breach, check};
use plumb_path::trajectory::{MotionLimits, Trajectory};
use plumb_protocol::message::{KNOTS, Reference, State, Telemetry};
use plumb_protocol::units::{Point, Speed};

use crate::deviation::{Deviations, PathPoint, PathSummary};
use crate::reference::{INTERVAL_S, reference};
use crate::rig::{MotionError, Rig};

/// First place of a path that the rig does not allow.
pub type PathPlanError = Breach<MotionError>;

/// Path for a run, within what the rig file allows.
#[derive(Debug, Clone)]
pub struct PathPlan {
    trajectory: Trajectory,
    waits: bool,
}

impl PathPlan {
    /// Checks a trajectory by the rig file: workspace, triangle and rates of the motors, and the
    /// limits of the table `[path]`. Where `waits`, the path goes slower while the ball is far from
    /// it or not seen; otherwise its time goes on.
    ///
    /// # Errors
    /// The first place that the rig does not allow.
    pub fn new(trajectory: Trajectory, waits: bool, rig: &Rig) -> Result<Self, PathPlanError> {
        let rules = rig.motion_rules();
        let in_motion =
            check(&trajectory, &path_limits(rig), |at| rules.check(at.position, at.velocity));
        if let Err(first) = in_motion {
            // No speed makes a place possible: it is told before a speed.
            check(&trajectory, &NO_LIMITS, |at| rules.check(at.position, Vector3::zeros()))?;
            return Err(first);
        }
        Ok(Self { trajectory, waits })
    }

    /// Returns the trajectory.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Returns whether the path goes slower while the ball cannot keep up.
    pub fn waits(&self) -> bool {
        self.waits
    }
}

/// Limits that every motion keeps.
const NO_LIMITS: MotionLimits =
    MotionLimits { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };

/// Returns the limits of the table `[path]` of the rig file.
fn path_limits(rig: &Rig) -> MotionLimits {
    MotionLimits {
        speed: rig.path.max_speed.get(),
        acceleration: rig.path.max_acceleration.get(),
        jerk: rig.path.max_jerk.get(),
    }
}

/// Number of reports that are kept: 2 s of telemetry at 30 Hz.
const REPORTS: usize = 60;

/// Decrease of the offset, seconds a second: the clocks of board and host drift.
const DRIFT: f64 = 1e-3;

/// Longest extrapolation beyond the last report, seconds: no link that drives is slower to answer.
const LONGEST_S: f64 = 1.0;

/// Report of the board.
#[derive(Debug, Clone, Copy)]
struct Report {
    /// Time on the board's clock, seconds.
    board: f64,
    /// The path's time then, seconds.
    path: f64,
}

/// Estimate of the path's time on the host's clock, from the board's telemetry.
///
/// The positions compare the two clocks: telemetry that names a position is later than the sending
/// of that position. The least such difference is the time that a position takes to the board and
/// through it. The board takes a position for as old as it was at its sending, so board and host
/// agree about the time of a picture.
#[derive(Debug, Clone, Default)]
struct PathClock {
    reports: VecDeque<Report>,
    /// The host's clock less the board's, and the board's time of this estimate, seconds.
    offset: Option<(f64, f64)>,
}

impl PathClock {
    /// Takes in a report. It names a position that was sent at `sent`, seconds on the host's clock;
    /// `None` where that is unknown.
    fn update(&mut self, report: Report, sent: Option<f64>) {
        if self.reports.back().is_some_and(|last| report.board <= last.board) {
            return;
        }
        if let Some(sent) = sent {
            let least = sent - report.board;
            let before = self.offset.map(|(offset, at)| offset - DRIFT * (report.board - at));
            self.offset = Some((before.map_or(least, |before| before.max(least)), report.board));
        }
        if self.reports.len() == REPORTS {
            self.reports.pop_front();
        }
        self.reports.push_back(report);
    }

    /// Returns the path's time of the last report, seconds.
    fn reported(&self) -> Option<f64> {
        self.reports.back().map(|report| report.path)
    }

    /// Returns the path's time at `time` on the host's clock, seconds; `None` before the first
    /// report and far from all of them.
    fn at(&self, time: f64) -> Option<f64> {
        let (offset, _) = self.offset?;
        let board = time - offset;
        let last = self.reports.len() - 1;
        let next = self.reports.iter().position(|report| report.board >= board);
        let next = next.unwrap_or(last).max(1);
        let (Some(from), Some(to)) = (self.reports.get(next - 1), self.reports.get(next)) else {
            // One report only.
            return self.reported();
        };
        let pace = (to.path - from.path) / (to.board - from.board);
        let distance = (board - to.board).max(from.board - board);
        (distance <= LONGEST_S).then_some(from.path + pace * (board - from.board))
    }
}

/// Least time between two messages, seconds: one with each picture of a usual camera.
pub(in crate::run) const LEAST_PERIOD_S: f64 = 0.03;

/// Speed of a path that is slower than the wire can say, or pauses: the least that is no rest.
const LEAST_SPEED: Speed = Speed(1);

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

    /// Returns the end of the path, of a loop its start, metres, rounded to the board's unit.
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
        let mut message = reference(0, self.plan.waits(), present, first, motion);
        let last = &mut message.knots[KNOTS - 1].velocity;
        if first + (KNOTS - 1) as f64 * INTERVAL_S < self.trajectory().duration()
            && last.iter().all(|speed| speed.0 == 0)
        {
            // The board takes a last knot at rest for the end of the path. A path may be so slow
            // that its speed is rounded to 0.
            last[0] = LEAST_SPEED;
        }
        message
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
        let duration = (!self.is_loop()).then(|| self.trajectory().duration());
        Some(self.deviations.summary(path_time, until - self.begin?, duration))
    }
}

#[cfg(test)]
mod tests {
    use plumb_path::check::Rule;
    use plumb_path::shape::{Plane, Shape, ShapeKind};
    use plumb_path::trajectory::{Run as PathRun, Sample};

    use super::*;
    use crate::rig::quantity::MotorRate;

    /// Returns the clock of a path at half its speed, which began at 10 s on the board's clock and
    /// 3 s on the host's. Its reports name positions that were sent `delay` before.
    fn clock(delay: impl Fn(u32) -> f64) -> PathClock {
        let mut clock = PathClock::default();
        for i in 0..100 {
            let elapsed = 0.033 * f64::from(i);
            let report = Report { board: 10.0 + elapsed, path: 0.5 * elapsed };
            clock.update(report, Some(3.0 + elapsed - delay(i)));
        }
        clock
    }

    #[test]
    fn the_time_of_a_moment_between_reports_is_known() {
        let clock = clock(|_| 0.0);
        for elapsed in [2.0, 2.5, 3.2, 3.4] {
            let found = clock.at(3.0 + elapsed).unwrap();
            assert!((found - 0.5 * elapsed).abs() < 1e-9, "{elapsed}: {found}");
        }
        assert_eq!(clock.at(5.0 + 3.0), None);
    }

    #[test]
    fn the_least_delay_counts() {
        let clock = clock(|i| if i % 7 == 3 { 0.002 } else { 0.030 });
        let found = clock.at(3.0 + 2.5).unwrap();
        assert!((found - 1.25).abs() < 0.002, "{found}");
    }

    #[test]
    fn a_path_that_is_too_fast_for_the_motors_is_refused() {
        let mut rig = Rig::paper().unwrap();
        rig.motors.max_rate = MotorRate::constant(110.0);
        let eight = |speed: f64| {
            let limits = MotionLimits { speed, ..path_limits(&rig) };
            let shape = Shape {
                kind: ShapeKind::Eight,
                centre: Point3::new(0.55, 0.3, 0.3),
                size: 0.2,
                plane: Plane::Level,
                tolerance: 0.005,
                seed: 1,
            };
            PathPlan::new(shape.trajectory(&limits, PathRun::Once).unwrap(), true, &rig)
        };
        let rule = eight(0.2).unwrap_err().rule;
        assert!(matches!(rule, Rule::Other(MotionError::MotorRate { .. })), "{rule:?}");
        // 110 steps/s of 0.471 mm are 52 mm of cable a second.
        assert!(eight(0.03).is_ok());
    }

    /// The board takes a last knot at rest for the end of the path.
    #[test]
    fn a_path_that_is_slower_than_the_wire_can_say_ends_at_its_end_only() {
        let sample = |time, x| Sample { time, position: Point3::new(x, 0.3, 0.3) };
        let samples = [sample(0.0, 0.5), sample(5000.0, 0.52), sample(10_000.0, 0.5)];
        let trajectory = Trajectory::through_samples(&samples, PathRun::Once).unwrap();
        let drive = PathDrive::new(PathPlan { trajectory, waits: true }, 0.0);
        let rests = |time| {
            let Reference { knots, .. } = drive.message(time, time);
            knots[KNOTS - 1].velocity.iter().all(|speed| speed.0 == 0)
        };
        assert_eq!([0.0, 1.0, 5000.0, 9999.0].map(rests), [false; 4]);
        assert_eq!([9999.5, 10_000.0].map(rests), [true; 2]);
    }

    #[test]
    fn a_clock_without_reports_knows_nothing() {
        assert_eq!(PathClock::default().at(1.0), None);
        assert_eq!(PathClock::default().reported(), None);
    }
}
