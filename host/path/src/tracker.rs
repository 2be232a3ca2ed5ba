//! A moving target that somebody tells the places of: its velocity, where it was, and where it will
//! be.
//!
//! Velocities that are not told follow from the last places, by the parabola with the least squares
//! of distances. The target is taken to go on for [`COAST_S`] after its last place, and to come to
//! rest within another [`BRAKE_S`]; sooner where it must not go on.

use std::collections::VecDeque;

use nalgebra::{Matrix3, Point3, Vector3};

use crate::moving::MovingTarget;
use crate::trajectory::Moment;

/// Time after its last place for which a target goes on at its speed, seconds: what the
/// board looks ahead (0.25 s), and the time between two places and two messages at 20 Hz.
pub const COAST_S: f64 = 0.4;

/// Time after that in which it comes to rest, seconds.
pub const BRAKE_S: f64 = 0.4;

/// Time of the target's motion from its last place to its rest, seconds.
const REACH_S: f64 = COAST_S + 0.5 * BRAKE_S;

/// Time of places that a velocity is computed from, seconds. Five at 30 Hz.
const FIT_S: f64 = 0.15;

/// Time for which places are kept, seconds: older than the pictures that are compared with them.
const KEPT_S: f64 = 0.5;

/// Largest number of places that are kept. Others in [`KEPT_S`] replace the oldest.
const MAX_KEPT: usize = 256;

/// Speed between two places above which the target has jumped, in multiples of the largest speed.
const JUMP_FACTOR: f64 = 4.0;

/// Distance between two places below which the target has not jumped, metres.
const LEAST_JUMP_M: f64 = 0.005;

/// Step of the search for the first place that is not allowed, seconds.
const SEARCH_S: f64 = 0.02;

/// Tracker of a moving target. Times are in seconds on one clock.
#[derive(Debug, Clone)]
pub struct TargetTracker {
    /// Largest speed of the target that is believed, m/s.
    max_speed: f64,
    /// The target after each of the last places, oldest first.
    states: VecDeque<State>,
}

/// The target after one of its places.
#[derive(Debug, Clone, Copy)]
struct State {
    time: f64,
    position: Point3<f64>,
    /// Whether the target has moved here from the place before, and has not jumped.
    is_continuous: bool,
    target: MovingTarget,
}

/// Motion of a target that comes to rest after its last place, or before the border of where it may
/// be.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    target: MovingTarget,
    /// Time of the last place, seconds.
    begin: f64,
    /// Time of the target's motion from there to its rest, seconds.
    reach: f64,
}

impl TargetTracker {
    /// Returns the tracker of a target that was not seen. A higher speed than `max_speed` (m/s)
    /// counts as this one.
    #[must_use]
    pub fn new(max_speed: f64) -> Self {
        Self { max_speed, states: VecDeque::new() }
    }

    /// Takes in that the target is at `position` (metres) at `time` (seconds), with `velocity`
    /// (m/s) where it is known. Returns whether it does: a time must be after the last one.
    pub fn observe(
        &mut self,
        time: f64,
        position: Point3<f64>,
        velocity: Option<Vector3<f64>>,
    ) -> bool {
        let last = self.states.back().copied();
        if last.is_some_and(|last| time <= last.time) {
            return false;
        }
        let is_continuous = last.is_some_and(|last| self.is_continuous(&last, time, position));
        while self.states.front().is_some_and(|first| first.time < time - KEPT_S)
            || self.states.len() >= MAX_KEPT
        {
            self.states.pop_front();
        }
        let velocity =
            velocity.unwrap_or_else(|| self.fitted_velocity(time, position, is_continuous));
        let mut target = match last {
            Some(last) if is_continuous => last.target,
            _ => MovingTarget::default(),
        };
        target.observe(time, position, velocity.cap_magnitude(self.max_speed));
        self.states.push_back(State { time, position, is_continuous, target });
        true
    }

    /// Takes in that the target rests at its last place from `time` (seconds) on.
    pub fn rest(&mut self, time: f64) {
        if let Some(last) = self.states.back() {
            let (after, position) = (time.max(last.time + 1e-6), last.position);
            self.observe(after, position, Some(Vector3::zeros()));
        }
    }

    /// Returns the last place, metres.
    #[must_use]
    pub fn last_position(&self) -> Option<Point3<f64>> {
        self.states.back().map(|last| last.position)
    }

    /// Returns the time of the last place, seconds.
    #[must_use]
    pub fn last_time(&self) -> Option<f64> {
        self.states.back().map(|last| last.time)
    }

    /// Returns the target's motion at `time` (seconds), by the last place before. `None` before
    /// every place that is kept, and long after the last one.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<Moment> {
        let state = self.states.iter().rev().find(|state| state.time <= time)?;
        (time - state.time <= COAST_S).then(|| state.target.at(time)).flatten()
    }

    /// Returns where the target will be: it stays in places that are allowed.
    #[must_use]
    pub fn course(&self, is_allowed: impl Fn(Point3<f64>) -> bool) -> Option<Course> {
        let State { time: begin, target, .. } = *self.states.back()?;
        let steps = (REACH_S / SEARCH_S).ceil() as u32;
        let may_be =
            |reach: f64| target.at(begin + reach).is_some_and(|moment| is_allowed(moment.position));
        let reaches = (1..=steps).map(|step| (SEARCH_S * f64::from(step)).min(REACH_S));
        let reach = reaches.take_while(|reach| may_be(*reach)).last().unwrap_or(0.0);
        Some(Course { target, begin, reach })
    }

    /// Returns whether a target can have moved from `last` to `position`.
    fn is_continuous(&self, last: &State, time: f64, position: Point3<f64>) -> bool {
        let gap = time - last.time;
        let farthest = JUMP_FACTOR * self.max_speed * gap + LEAST_JUMP_M;
        gap <= KEPT_S && (position - last.position).norm() <= farthest
    }

    /// Returns the velocity at a new place by those before it, m/s; zero after a jump.
    fn fitted_velocity(
        &self,
        time: f64,
        position: Point3<f64>,
        is_continuous: bool,
    ) -> Vector3<f64> {
        if !is_continuous {
            return Vector3::zeros();
        }
        let mut places = vec![(0.0, Vector3::zeros())];
        for state in self.states.iter().rev() {
            if places.len() >= 3 && time - state.time > FIT_S {
                break;
            }
            places.push((state.time - time, state.position - position));
            if !state.is_continuous {
                break;
            }
        }
        slope(&places)
    }
}

/// Returns the velocity at time 0 of the parabola with the least squares of distances from `places`
/// at their times; of a straight line where there are two.
fn slope(places: &[(f64, Vector3<f64>)]) -> Vector3<f64> {
    if let [_, (time, place)] = places {
        return place / *time;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Matrix3::zeros());
    for (time, place) in places {
        let time = time / FIT_S;
        let powers = Vector3::new(1.0, time, time * time);
        normal += powers * powers.transpose();
        right += powers * place.transpose();
    }
    let solved = normal.cholesky().map(|cholesky| cholesky.solve(&right));
    solved.map_or_else(Vector3::zeros, |solved| solved.row(1).transpose() / FIT_S)
}

impl Course {
    /// Returns the motion at `time` (seconds), not before the last place.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<Moment> {
        let (elapsed, pace) = self.pace((time - self.begin).max(0.0));
        let moment = self.target.at(self.begin + elapsed)?;
        Some(Moment { velocity: moment.velocity * pace, ..moment })
    }

    /// Returns how much of the target's motion has passed `time` seconds after the last place,
    /// seconds, and how fast it passes: 1 is the target's own speed.
    fn pace(&self, time: f64) -> (f64, f64) {
        // Near the border the target is slower, so that it rests before it.
        let first = (2.0 * self.reach / BRAKE_S).min(1.0);
        let braking = first * BRAKE_S;
        let coast = if first < 1.0 { 0.0 } else { self.reach - 0.5 * BRAKE_S };
        let into = (time - coast).clamp(0.0, braking);
        let passed = first * (time.min(coast) + into) - 0.5 * into * into / BRAKE_S;
        (passed.min(self.reach), (first - into / BRAKE_S).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEED: f64 = 0.3;

    fn anywhere(_: Point3<f64>) -> bool {
        true
    }

    /// Returns the place on a circle of 10 cm at 1 rad/s.
    fn circle(time: f64) -> Point3<f64> {
        Point3::new(0.1 * time.cos(), 0.1 * time.sin(), 0.3)
    }

    /// Returns a tracker that was told places on the circle at `rate` (Hz) for 2 s, each with the
    /// error `error(k)` (metres) of its number.
    fn told(rate: f64, error: impl Fn(u32) -> Vector3<f64>) -> TargetTracker {
        let mut tracker = TargetTracker::new(SPEED);
        for k in 0..=(2.0 * rate) as u32 {
            let time = f64::from(k) / rate;
            assert!(tracker.observe(time, circle(time) + error(k), None));
        }
        tracker
    }

    #[test]
    fn places_alone_tell_where_the_target_will_be() {
        for (rate, tolerance) in [(30.0, 1e-3), (200.0, 1e-3), (10.0, 4e-3)] {
            let course = told(rate, |_| Vector3::zeros()).course(anywhere).unwrap();
            for ahead in [0.0, 0.1, 0.2, 0.3, 0.4] {
                let off = (course.at(2.0 + ahead).unwrap().position - circle(2.0 + ahead)).norm();
                assert!(off < tolerance, "{rate} Hz, {ahead} s ahead: {off}");
            }
        }
    }

    #[test]
    fn noise_of_the_places_does_not_swing_the_course() {
        // 1 mm to either side in turn.
        let noise = |k: u32| Vector3::new(0.0, 0.0, if k.is_multiple_of(2) { 1e-3 } else { -1e-3 });
        let course = told(200.0, noise).course(anywhere).unwrap();
        let off = (course.at(2.3).unwrap().position - circle(2.3)).norm();
        assert!(off < 0.02, "{off}");
    }

    #[test]
    fn a_target_that_is_not_told_of_comes_to_rest_and_stays() {
        let mut tracker = TargetTracker::new(SPEED);
        tracker.observe(1.0, Point3::origin(), Some(Vector3::x() * 0.1));
        let course = tracker.course(anywhere).unwrap();
        let mut before = course.at(1.0).unwrap();
        assert_eq!(before.velocity, Vector3::x() * 0.1);
        for k in 1..200 {
            let moment = course.at(1.0 + 0.005 * f64::from(k)).unwrap();
            let moved = (moment.position - before.position).x;
            let mean = 0.5 * (moment.velocity + before.velocity).x;
            assert!((moved - 0.005 * mean).abs() < 1e-5, "{k}: {moment:?}");
            before = moment;
        }
        assert_eq!(before.velocity, Vector3::zeros());
        assert!((before.position.x - 0.1 * REACH_S).abs() < 1e-9, "{before:?}");
        tracker.rest(2.0);
        let rest = tracker.course(anywhere).unwrap().at(5.0).unwrap();
        assert_eq!(rest, Moment::resting(Point3::origin()));
    }

    #[test]
    fn the_course_ends_before_a_border_at_every_distance_from_it() {
        for millimetres in 0..100 {
            let mut tracker = TargetTracker::new(SPEED);
            let place = Point3::new(-1e-3 * f64::from(millimetres), 0.0, 0.0);
            tracker.observe(0.0, place, Some(Vector3::x() * 0.1));
            let course = tracker.course(|place| place.x <= 0.0).unwrap();
            let end = course.at(9.0).unwrap();
            assert!((-0.1..=0.0).contains(&end.position.x) && end.velocity.norm() == 0.0);
            let reached = end.position.x - place.x;
            let most = (-place.x).min(0.1 * REACH_S);
            // Within the way that braking takes, the target is slower from the beginning.
            let is_near = -place.x < 0.1 * (0.5 * BRAKE_S + SEARCH_S);
            let least = if is_near { 0.0 } else { most - 0.1 * SEARCH_S };
            assert!((least - 1e-12..=most + 1e-12).contains(&reached), "{millimetres} mm");
            assert_eq!(course.at(0.0).unwrap().position, place);
        }
    }

    #[test]
    fn a_jump_has_no_velocity() {
        let mut tracker = told(30.0, |_| Vector3::zeros());
        let place = circle(2.0) + Vector3::z() * 0.2;
        tracker.observe(2.033, place, None);
        assert_eq!(tracker.course(anywhere).unwrap().at(9.0).unwrap(), Moment::resting(place));
        // The next places do not look back beyond the jump.
        tracker.observe(2.066, place + Vector3::x() * 1e-3, None);
        let velocity = tracker.course(anywhere).unwrap().at(2.066).unwrap().velocity;
        assert!((velocity - Vector3::x() * (1e-3 / 0.033)).norm() < 1e-9, "{velocity}");
    }

    #[test]
    fn an_old_place_is_left_out_and_the_past_is_remembered() {
        let mut tracker = told(30.0, |_| Vector3::zeros());
        assert!(!tracker.observe(1.99, Point3::origin(), None));
        assert!(!tracker.observe(2.0, Point3::origin(), None));
        for time in [1.6, 1.75, 1.99] {
            let off = (tracker.at(time).unwrap().position - circle(time)).norm();
            assert!(off < 1e-4, "{time}: {off}");
        }
        assert_eq!(tracker.at(1.0), None);
        assert_eq!(tracker.at(2.5), None);
        assert_eq!((tracker.last_time(), tracker.last_position()), (Some(2.0), Some(circle(2.0))));
    }

    #[test]
    fn a_speed_beyond_the_largest_counts_as_that() {
        let mut tracker = TargetTracker::new(SPEED);
        tracker.observe(0.0, Point3::origin(), Some(Vector3::y() * 9.0));
        let moment = tracker.course(anywhere).unwrap().at(0.0).unwrap();
        assert!((moment.velocity - Vector3::y() * SPEED).norm() < 1e-12);
    }
}
