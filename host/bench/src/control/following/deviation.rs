//! Deviations of a ball from its reference.

use nalgebra::Point3;

use super::super::report::quantile;
use super::course::Course;
use super::follower::Reading;

/// Start of the measurement, seconds after the start of the run.
const SETTLED_S: f64 = 3.0;
/// Deviation at which a run is lost, metres.
const LOST_M: f64 = 0.05;
/// Newton's steps from the reference to the nearest place of the path.
const FOOT_STEPS: usize = 2;
/// Speed below which the reference counts as at rest, m/s: its direction is then not known.
const REST_M_S: f64 = 1e-4;
/// Largest distance of the nearest place of the path, as path's time, seconds.
const FOOT_RANGE_S: f64 = 1.0;

/// Deviations of a whole run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Deviations {
    /// Root mean square of the distance from the reference, metres.
    pub(super) rms_m: f64,
    /// 99 % quantile of that distance, metres.
    pub(super) p99_m: f64,
    /// Root mean square of the distance from the nearest place of the path, metres.
    pub(super) cross_m: f64,
    /// Path's time over real time.
    pub(super) kept: f64,
}

/// Measurement of deviations during a run.
pub(super) struct Gauge<'a> {
    course: &'a Course,
    /// Positions of the ball after the last reading: moment (seconds) and place (metres).
    pending: Vec<(f64, Point3<f64>)>,
    /// Last reading of the path's time.
    last: Option<Reading>,
    /// First reading of the measurement.
    begin: Option<Reading>,
    /// Distances from the reference, metres.
    errors: Vec<f64>,
    /// Sum of the squares of the distances from the path, m².
    cross_squares: f64,
    is_lost: bool,
}

impl<'a> Gauge<'a> {
    /// Creates the measurement of a run along `course`.
    pub(super) fn new(course: &'a Course) -> Self {
        Self {
            course,
            pending: Vec::new(),
            last: None,
            begin: None,
            errors: Vec::new(),
            cross_squares: 0.0,
            is_lost: false,
        }
    }

    /// Takes in where the ball is at a moment, seconds, and the newest reading of the path's time.
    /// Between two readings the path's time is linear.
    pub(super) fn update(&mut self, at_s: f64, ball: Point3<f64>, reading: Option<Reading>) {
        self.pending.push((at_s, ball));
        let Some(reading) = reading else { return };
        let last = *self.last.get_or_insert(reading);
        if reading.at_s <= last.at_s {
            return;
        }
        let pace = (reading.path_s - last.path_s) / (reading.at_s - last.at_s);
        let due = self.pending.partition_point(|(at_s, _)| *at_s <= reading.at_s);
        for (at_s, ball) in self.pending.drain(..due).collect::<Vec<_>>() {
            if at_s >= last.at_s {
                self.measure(at_s, last.path_s + pace * (at_s - last.at_s), ball);
            }
        }
        if reading.at_s >= SETTLED_S {
            self.begin.get_or_insert(reading);
        }
        self.last = Some(reading);
    }

    /// Measures the ball at a moment and the path's time then, seconds.
    fn measure(&mut self, at_s: f64, path_s: f64, ball: Point3<f64>) {
        let error = (ball - self.course.at(path_s).position).norm();
        self.is_lost |= error > LOST_M;
        if at_s >= SETTLED_S {
            self.errors.push(error);
            self.cross_squares += self.cross_track_m(path_s, ball).powi(2);
        }
    }

    /// Returns the distance of the ball from the nearest place of the path, metres. Newton's method
    /// finds it from the reference at `path_s` on.
    fn cross_track_m(&self, path_s: f64, ball: Point3<f64>) -> f64 {
        let mut foot_s = path_s;
        for _ in 0..FOOT_STEPS {
            let moment = self.course.at(foot_s);
            let speed = moment.velocity.norm();
            if speed > REST_M_S {
                let ahead = (ball - moment.position).dot(&moment.velocity) / (speed * speed);
                foot_s += ahead.clamp(-FOOT_RANGE_S, FOOT_RANGE_S);
            }
        }
        (ball - self.course.at(foot_s).position).norm()
    }

    /// Returns whether the ball was too far from the reference.
    pub(super) fn is_lost(&self) -> bool {
        self.is_lost
    }

    /// Returns the deviations; `None` where nothing was measured.
    pub(super) fn deviations(mut self) -> Option<Deviations> {
        let (begin, last) = self.begin.zip(self.last)?;
        if self.errors.is_empty() || last.at_s <= begin.at_s {
            return None;
        }
        let n = self.errors.len() as f64;
        let squares: f64 = self.errors.iter().map(|error| error * error).sum();
        self.errors.sort_by(f64::total_cmp);
        Some(Deviations {
            rms_m: (squares / n).sqrt(),
            p99_m: quantile(&self.errors, 0.99),
            cross_m: (self.cross_squares / n).sqrt(),
            kept: (last.path_s - begin.path_s) / (last.at_s - begin.at_s),
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use plumb_path::shape::{Plane, Shape, ShapeKind};

    use super::*;

    /// Returns a circle of radius 0.1 m at 0.1 m/s.
    fn circle() -> Course {
        let shape = Shape {
            kind: ShapeKind::Circle,
            centre: Point3::new(0.5, 0.4, 0.3),
            size: 0.2,
            plane: Plane::Level,
            tolerance: 0.0,
            seed: 0,
        };
        Course::new(&shape, 0.1).unwrap()
    }

    /// Measures a ball that lags by `lag_s` on a path that goes at `pace`, `off_m` above it.
    fn measure(lag_s: f64, pace: f64, off_m: f64) -> Gauge<'static> {
        let course: &'static Course = Box::leak(Box::new(circle()));
        let mut gauge = Gauge::new(course);
        for k in 0..2000 {
            let at_s = 0.005 * f64::from(k);
            let ball = course.at(pace * at_s - lag_s).position + Vector3::z() * off_m;
            // Readings come every 30 ms.
            let read_s = 0.03 * (at_s / 0.03).floor();
            gauge.update(at_s, ball, Some(Reading { at_s: read_s, path_s: pace * read_s }));
        }
        gauge
    }

    #[test]
    fn a_lag_is_no_cross_track_error() {
        let found = measure(0.1, 1.0, 0.0).deviations().unwrap();
        assert!(
            (found.rms_m - 0.01).abs() < 1e-4 && (found.p99_m - 0.01).abs() < 1e-4,
            "{found:?}"
        );
        assert!(found.cross_m < 1e-5, "{found:?}");
        assert!((found.kept - 1.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_path_that_waits_keeps_less_of_its_speed() {
        let found = measure(0.0, 0.5, 0.002).deviations().unwrap();
        assert!((found.kept - 0.5).abs() < 1e-9, "{found:?}");
        assert!((found.rms_m - 0.002).abs() < 1e-6, "{found:?}");
        assert!((found.cross_m - 0.002).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_ball_that_is_5_cm_away_is_lost() {
        assert!(measure(0.0, 1.0, 0.051).is_lost());
        assert!(!measure(0.0, 1.0, 0.049).is_lost());
    }

    #[test]
    fn nothing_is_measured_of_a_controller_that_never_follows() {
        let course = circle();
        let mut gauge = Gauge::new(&course);
        (0..2000).for_each(|k| gauge.update(0.005 * f64::from(k), course.start(), None));
        assert_eq!(gauge.deviations(), None);
    }
}
