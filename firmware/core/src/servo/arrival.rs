//! When a target counts as reached.

use plumb_protocol::config::Reached;

/// Detector of the ball's arrival at its target: it counts positions near the target in a row.
///
/// A rule that takes one raw position is wrong in 25 % of runs, this one in none of 1000
/// (docs/understand/method.md). The filter hides part of a swing, so the detector also watches the
/// residuals of the positions. White noise has no memory, so the mean product of two residuals in a
/// row is zero or less; the residuals of a swing are correlated, and the mean is above zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ArrivalDetector {
    /// Positions near the target in a row.
    frames: u8,
    /// Last residual, µm.
    residual: [i32; 3],
    /// Mean product of two residuals in a row, µm².
    swing: i64,
}

impl ArrivalDetector {
    /// Takes in the filtered |e| after a position (`filtered`, µm) and the residual of that
    /// position ([`BallTracker::residual`](super::BallTracker::residual)). Returns whether the
    /// target counts as reached now.
    pub fn update(&mut self, filtered: u32, residual: [i32; 3], rule: &Reached) -> bool {
        let radius = rule.radius.0.unsigned_abs();
        // 0.8 of the radius, so that noise at the rim does not count; radius <= 1 m, so 23 bits.
        let near = filtered * 5 <= radius * 4;
        self.frames = if near { self.frames.saturating_add(1) } else { 0 };
        self.update_swing(residual, radius);
        self.frames >= rule.frames && self.is_at_rest(filtered, radius)
    }

    /// Averages the products over sixteen positions, half a second at 30 Hz. A product counts as
    /// radius²/2 at most, so that the mean forgets the way to the target within the positions that
    /// are counted.
    fn update_swing(&mut self, residual: [i32; 3], radius: u32) {
        let most = i64::from(radius) * i64::from(radius) / 2;
        let product: i64 =
            (0..3).map(|i| i64::from(residual[i]) * i64::from(self.residual[i])).sum();
        self.swing += (product.clamp(-most, most) - self.swing) / 16;
        self.residual = residual;
    }

    /// Checks whether the filtered |e| and the swing about it are together within 0.8 of the
    /// radius. The square of an amplitude is twice its mean square, and the residual has half of it
    /// at 1.4 Hz, the frequency of a ball on springs or on two cables.
    fn is_at_rest(&self, filtered: u32, radius: u32) -> bool {
        let square = |v: u32| i64::from(v) * i64::from(v);
        25 * (square(filtered) + 4 * self.swing.max(0)) <= 16 * square(radius)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BallTracker, magnitude};
    use super::*;
    use plumb_protocol::units::{Micrometres, Micros};

    /// Returns the position number at which a ball has reached 0 within 10 mm; at most 300. The
    /// ball comes in ten positions from 100 mm away and then is at `x` (µm, of the number).
    fn reached_at(x: impl Fn(i32) -> i32) -> Option<i32> {
        let rule = Reached { radius: Micrometres(10_000), frames: 10 };
        let (mut tracker, mut arrival) = (BallTracker::default(), ArrivalDetector::default());
        (0..300).find(|k| {
            tracker.update(Micros(0), [x(*k) + (100_000 - 10_000 * k).max(0), 0, 0]);
            let filtered = tracker.filtered().map_or(u32::MAX, magnitude);
            arrival.update(filtered, tracker.residual(), &rule)
        })
    }

    #[test]
    fn a_ball_that_swings_about_its_target_has_not_reached_it() {
        // 3.75 Hz at 30 positions/s; the filter leaves a third of it.
        const EIGHTHS: [i32; 8] = [0, 71, 100, 71, 0, -71, -100, -71];
        let swing = |amplitude: i32| move |k: i32| amplitude * EIGHTHS[k as usize % 8] / 100;
        assert_eq!(reached_at(swing(15_000)), None);
        assert!(reached_at(swing(3_000)).is_some_and(|k| k < 35));
        assert_eq!(
            reached_at(|k| swing((100_000 - 1_000 * k).max(0))(k)).map(|k| k > 85),
            Some(true)
        );
    }

    #[test]
    fn white_noise_does_not_delay_the_arrival() {
        assert!(reached_at(|k| if k % 2 == 0 { 6_000 } else { -6_000 }).is_some_and(|k| k < 35));
    }
}
