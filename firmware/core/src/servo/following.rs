//! The guard against motors that turn while the ball does not follow.

use plumb_protocol::config::Following;

/// Guard against a motor that turns far while the ball stays where it is: a cable is slack, slips
/// or is torn, a motor has stalled, or the ball is caught.
///
/// The ends of a taut cable are apart by its length. By the triangle inequality a ball on taut
/// cables therefore moves at least as far as the length of any cable changes, whatever the rig's
/// geometry. The guard compares both from one place to the next: a place ends when the ball has
/// left it. It does not depend on the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FollowingGuard {
    place: Option<Place>,
}

/// Where the ball and the motors were at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    /// Position of the ball, µm.
    ball: [i32; 3],
    /// Motor positions, Q4 steps.
    motors: [i32; 3],
}

impl FollowingGuard {
    /// Takes in the filtered position of the `ball` (µm) and the positions of the `motors` (Q4
    /// steps). Returns whether a motor has turned by the rule's turn while the ball has moved along
    /// no axis by more than the rule's movement.
    pub(super) fn update(&mut self, ball: [i32; 3], motors: [i32; 3], rule: &Following) -> bool {
        let place = *self.place.get_or_insert(Place { ball, motors });
        if farthest(ball, place.ball) > rule.movement.0.unsigned_abs() {
            self.place = Some(Place { ball, motors });
            return false;
        }
        farthest(motors, place.motors) > rule.turn.0.unsigned_abs()
    }
}

/// Returns the largest difference of a component.
fn farthest(a: [i32; 3], b: [i32; 3]) -> u32 {
    let [x, y, z] = [0, 1, 2].map(|i| a[i].abs_diff(b[i]));
    x.max(y).max(z)
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::{Micrometres, Steps16};

    use super::*;

    const RULE: Following = Following { turn: Steps16(1600), movement: Micrometres(20_000) };

    /// Returns whether the guard stops a motor that turned by `turn` while the ball moved by
    /// `movement`, and one that turned by the rule's turn more from there.
    fn stops(turn: i32, movement: i32) -> [bool; 2] {
        let mut guard = FollowingGuard::default();
        assert!(!guard.update([0; 3], [0; 3], &RULE));
        let ball = [0, -movement, 0];
        let first = guard.update(ball, [0, 0, -turn], &RULE);
        [first, guard.update(ball, [0, 0, -turn - RULE.turn.0], &RULE)]
    }

    #[test]
    fn a_motor_may_turn_by_the_rules_turn_and_no_further() {
        assert_eq!(stops(1600, 0), [false, true]);
        assert_eq!(stops(1601, 0), [true, true]);
    }

    #[test]
    fn the_ball_must_move_by_more_than_the_rules_movement_to_be_at_another_place() {
        assert_eq!(stops(1, 20_000), [false, true]);
        assert_eq!(stops(1601, 20_000), [true, true]);
        assert_eq!(stops(1601, 20_001), [false, false]);
    }
}
