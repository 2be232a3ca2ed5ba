//! A point that chases a moving one within limits of speed, acceleration and jerk.

use plumb_protocol::config::PathLimits;

use super::path::Motion;
use crate::vector::{length, plus, scaled, shortened};

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
pub(super) struct Limits {
    /// mm/s.
    speed: f32,
    /// mm/s².
    acceleration: f32,
    /// mm/s³.
    jerk: f32,
}

impl Limits {
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
    pub(super) fn chasing(self, leader: &Motion, limits: &Limits, closing: f32, dt: f32) -> Self {
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
    use super::*;

    const LIMITS: Limits = Limits { speed: 300.0, acceleration: 1000.0, jerk: 10_000.0 };
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
