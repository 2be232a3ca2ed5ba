//! The part of a path that the host has sent last, and a point that chases it within limits of
//! speed, acceleration and jerk.

use plumb_protocol::config::PathLimits;
use plumb_protocol::dimension::AXES;
use plumb_protocol::message::{KNOTS, Knot, Reference};
use plumb_protocol::units::Point;

use crate::vector::{Vector, length, plus, scaled, shortened};

/// Position (mm), velocity (mm/s) and acceleration (mm/s²) at a moment of a path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Motion {
    pub(super) position: Vector,
    pub(super) velocity: Vector,
    pub(super) acceleration: Vector,
}

impl Motion {
    /// Returns the motion where the path's time passes at `pace`, which changes by `change` a
    /// second.
    pub(super) fn paced(&self, pace: f32, change: f32) -> Self {
        Self {
            position: self.position,
            velocity: scaled(self.velocity, pace),
            acceleration: plus(scaled(self.acceleration, pace * pace), self.velocity, change),
        }
    }
}

/// Knots of a path, and cubic Hermite polynomials between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Path {
    /// The path's time at the first knot, µs.
    first: i64,
    /// Time from a knot to the next, µs.
    interval_us: u32,
    knots: [Knot; KNOTS],
}

/// Returns the position of a knot, mm, and its velocity, mm/s.
fn state(knot: &Knot) -> (Vector, Vector) {
    let millimetres = |micrometres: i32| micrometres as f32 * 1e-3;
    (knot.position.micrometres().map(millimetres), knot.velocity.map(|v| millimetres(v.0)))
}

impl Path {
    /// Creates the path of a message that was checked.
    pub(super) fn new(reference: &Reference) -> Self {
        // A host counts microseconds from a zero of its own: 63 bits are 292 000 years.
        let first = reference.first.0.min(i64::MAX as u64) as i64;
        Self { first, interval_us: reference.interval_us, knots: reference.knots }
    }

    /// Returns the path's time at the last knot, µs.
    pub(super) fn end(&self) -> i64 {
        self.first.saturating_add(i64::from(self.interval_us) * (KNOTS as i64 - 1))
    }

    /// Returns the position of the last knot.
    pub(super) fn last(&self) -> Point {
        self.knots[KNOTS - 1].position
    }

    /// Returns whether the path rests from `time` (µs) on: it has ended.
    pub(super) fn rests_from(&self, time: i64) -> bool {
        let since = time.saturating_sub(self.first).clamp(0, i64::from(u32::MAX)) as u32;
        let passed = ((since / self.interval_us) as usize).min(KNOTS - 1);
        let last = &self.knots[KNOTS - 1];
        self.has_end() && self.knots[passed..].iter().all(|knot| knot == last)
    }

    /// Returns whether the last knot is at rest: the path ends there.
    pub(super) fn has_end(&self) -> bool {
        self.knots[KNOTS - 1].velocity.iter().all(|v| v.0 == 0)
    }

    /// Returns the motion at `time` (µs). Before the first knot and after the last one the
    /// reference rests there.
    pub(super) fn at(&self, time: i64) -> Motion {
        let since = time.saturating_sub(self.first);
        let rest = |knot: &Knot| Motion { position: state(knot).0, ..Motion::default() };
        if since < 0 {
            return rest(&self.knots[0]);
        }
        // At most 2.5 s.
        let since = since.min(i64::from(u32::MAX)) as u32;
        let before = (since / self.interval_us) as usize;
        let Some([from, to]) = self.knots.get(before..before + 2) else {
            return rest(&self.knots[KNOTS - 1]);
        };
        let interval_s = self.interval_us as f32 * 1e-6;
        between(state(from), state(to), (since % self.interval_us) as f32 * 1e-6, interval_s)
    }
}

/// Returns the motion `t` seconds after the first of two knots that are `h` seconds apart, by the
/// cubic polynomial with their positions and velocities.
fn between(from: (Vector, Vector), to: (Vector, Vector), t: f32, h: f32) -> Motion {
    let ((p, v), (q, w)) = (from, to);
    let per_interval = 1.0 / h;
    let (mut square, mut cube) = ([0.0; AXES], [0.0; AXES]);
    for i in 0..AXES {
        let mean = (q[i] - p[i]) * per_interval;
        square[i] = (3.0 * mean - 2.0 * v[i] - w[i]) * per_interval;
        cube[i] = (v[i] + w[i] - 2.0 * mean) * per_interval * per_interval;
    }
    // Horner's rule for the polynomial and its derivatives.
    Motion {
        position: plus(p, plus(v, plus(square, cube, t), t), t),
        velocity: plus(v, plus(square, cube, 1.5 * t), 2.0 * t),
        acceleration: plus(square, cube, 3.0 * t).map(|a| 2.0 * a),
    }
}

/// Rate of the return to the path over the distance from it, 1/s.
const POSITION_GAIN: f32 = 5.0;
/// Acceleration over the difference of the velocities, 1/s. With [`POSITION_GAIN`] the return is
/// damped with ζ = 0.9.
const VELOCITY_GAIN: f32 = 16.0;
/// Share of the acceleration that braking before the path is planned with: the jerk's limit takes
/// the rest.
const BRAKING_SHARE: f32 = 0.3;

/// Limits of the reference's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionLimits {
    /// mm/s.
    speed: f32,
    /// mm/s².
    acceleration: f32,
    /// mm/s³.
    jerk: f32,
}

impl MotionLimits {
    /// Converts the limits of a configuration.
    pub(super) fn new(limits: &PathLimits) -> Self {
        Self {
            speed: limits.speed.0 as f32 / 1000.0,
            acceleration: limits.acceleration.0.into(),
            jerk: limits.jerk.0 as f32,
        }
    }
}

impl Motion {
    /// Returns the motion `dt` seconds later of a point that chases `leader`, with at most
    /// `closing` of the speed at which it may close up (0 to 1). A point that moves with its leader
    /// stays with it: the leader's acceleration is its own.
    pub(super) fn chasing(
        self,
        leader: &Motion,
        limits: &MotionLimits,
        closing: f32,
        dt: f32,
    ) -> Self {
        let behind = plus(leader.position, self.position, -1.0);
        let distance = length(behind);
        // The speed from which the point stops at its leader.
        let braking = libm::sqrtf(2.0 * BRAKING_SHARE * limits.acceleration * distance);
        let speed = closing * (POSITION_GAIN * distance).min(braking);
        let wanted = plus(leader.velocity, behind, speed / distance.max(1e-3));
        let wanted = shortened(wanted, limits.speed);
        let faster = plus(wanted, self.velocity, -1.0);
        let acceleration = plus(leader.acceleration, faster, VELOCITY_GAIN);
        let acceleration = shortened(acceleration, limits.acceleration);
        let change = plus(acceleration, self.acceleration, -1.0);
        let change = shortened(change, limits.jerk * dt);
        let acceleration = plus(self.acceleration, change, 1.0);
        // A leader may accelerate for long and gain no speed: its messages need not make sense.
        let velocity = shortened(plus(self.velocity, acceleration, dt), limits.speed);
        let middle = scaled(plus(self.velocity, velocity, 1.0), 0.5);
        Self { position: plus(self.position, middle, dt), velocity, acceleration }
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::{Micrometres, Micros, Speed};

    use super::*;

    /// Returns knots on a circle of 100 mm with 50 mm/s, every 120 ms from 1 s on.
    fn circle() -> Path {
        let knot = |k: usize| {
            let (sin, cos) = (libm::sinf(0.06 * k as f32), libm::cosf(0.06 * k as f32));
            Knot {
                position: Point([cos * 1e5, sin * 1e5, 0.0].map(|v| Micrometres(v as i32))),
                velocity: [-sin * 5e4, cos * 5e4, 0.0].map(|v| Speed(v as i32)),
            }
        };
        Path::new(&Reference {
            sequence: 0,
            now: Micros(1_000_000),
            waits: true,
            first: Micros(1_000_000),
            interval_us: 120_000,
            knots: core::array::from_fn(knot),
        })
    }

    #[test]
    fn the_polynomials_lie_on_a_circle() {
        for ms in 0..600 {
            let motion = circle().at(1_000_000 + ms * 1000);
            let angle = 0.5 * ms as f32 * 1e-3;
            let exact = [100.0 * libm::cosf(angle), 100.0 * libm::sinf(angle), 0.0];
            let speed = [-0.5 * exact[1], 0.5 * exact[0], 0.0];
            for i in 0..AXES {
                assert!((motion.position[i] - exact[i]).abs() < 0.003, "{ms} {motion:?}");
                assert!((motion.velocity[i] - speed[i]).abs() < 0.05, "{ms} {motion:?}");
                assert!((motion.acceleration[i] + 0.25 * exact[i]).abs() < 1.0, "{ms} {motion:?}");
            }
        }
    }

    #[test]
    fn the_reference_rests_before_the_first_knot_and_after_the_last_one() {
        let path = circle();
        assert_eq!(path.end(), 1_600_000);
        assert!(!path.has_end());
        for (time, knot) in [(i64::MIN, 0), (0, 0), (1_600_001, 5), (i64::MAX, 5)] {
            let rest = Motion { position: state(&path.knots[knot]).0, ..Motion::default() };
            assert_eq!(path.at(time), rest);
        }
    }

    #[test]
    fn a_path_rests_from_the_first_of_its_last_knots_that_are_the_same() {
        let mut ends = circle();
        let last = Knot { position: Point::default(), velocity: [Speed(0); 3] };
        ends.knots[3..].fill(last);
        let rests = [0, 1_359_999, 1_360_000, 9_000_000].map(|t| ends.rests_from(t));
        assert_eq!(rests, [false, false, true, true]);
        assert_eq!(ends.last(), last.position);
        assert!(!circle().rests_from(9_000_000));
        assert_eq!(circle().last(), circle().knots[5].position);
    }

    #[test]
    fn at_half_the_pace_an_acceleration_is_a_quarter() {
        let motion = Motion { acceleration: [8.0, 0.0, -4.0], ..Motion::default() };
        assert_eq!(motion.paced(0.5, 0.0).acceleration, [2.0, 0.0, -1.0]);
    }

    const LIMITS: MotionLimits =
        MotionLimits { speed: 300.0, acceleration: 1000.0, jerk: 10_000.0 };
    const DT: f32 = 0.016;
    const STEPS: usize = 250;

    /// Runs a point after a leader for 4 s. Returns its motions.
    fn chase(leader: impl Fn(f32) -> Motion) -> [Motion; STEPS] {
        let mut point = Motion::default();
        core::array::from_fn(|k| {
            point = point.chasing(&leader(k as f32 * DT), &LIMITS, 1.0, DT);
            point
        })
    }

    fn check_limits(motions: &[Motion]) {
        let mut before = Motion::default();
        for motion in motions {
            assert!(length(motion.velocity) < 1.01 * LIMITS.speed, "{motion:?}");
            assert!(length(motion.acceleration) < 1.001 * LIMITS.acceleration, "{motion:?}");
            let jerk = length(plus(motion.acceleration, before.acceleration, -1.0)) / DT;
            assert!(jerk < 1.001 * LIMITS.jerk, "{motion:?}");
            before = *motion;
        }
    }

    #[test]
    fn a_jump_is_followed_within_the_limits_and_without_swinging() {
        for distance in [1.0, 20.0, 50.0, 100.0, 150.0, 200.0, 600.0] {
            let motions = chase(|_| Motion { position: [distance, 0.0, 0.0], ..Motion::default() });
            check_limits(&motions);
            let farthest = motions.iter().fold(0.0, |far: f32, motion| far.max(motion.position[0]));
            assert!(farthest < 1.005 * distance + 0.1, "{distance} {farthest}");
            assert!((motions[STEPS - 1].position[0] - distance).abs() < 0.05, "{distance}");
        }
    }

    #[test]
    fn a_jump_is_followed_with_the_share_of_the_acceleration_for_braking() {
        let motions = chase(|_| Motion { position: [100.0, 0.0, 0.0], ..Motion::default() });
        // From 245 mm/s on, at 300 mm/s²: with half of the share it takes 0.2 s more.
        assert!((94.0..99.0).contains(&motions[46].position[0]), "{:?}", motions[46]);
    }

    #[test]
    fn a_leader_that_accelerates_and_gains_no_speed_does_not_break_the_limit() {
        let leader = Motion { acceleration: [-50_000.0, 9_000.0, 0.0], ..Motion::default() };
        for motion in chase(|_| leader) {
            assert!(length(motion.velocity) < 1.001 * LIMITS.speed, "{motion:?}");
        }
    }

    #[test]
    fn a_circle_is_kept_without_a_lag() {
        let leader = |t: f32| {
            let (sin, cos) = (libm::sinf(t), libm::cosf(t));
            Motion {
                position: [100.0 * cos - 100.0, 100.0 * sin, 0.0],
                velocity: [-100.0 * sin, 100.0 * cos, 0.0],
                acceleration: [-100.0 * cos, -100.0 * sin, 0.0],
            }
        };
        let motions = chase(leader);
        check_limits(&motions);
        for (k, motion) in motions.iter().enumerate().skip(120) {
            let off = length(plus(motion.position, leader((k + 1) as f32 * DT).position, -1.0));
            assert!(off < 0.05, "{k} {off}");
        }
    }
}
