//! The ball: its filtered position, its error, and when it counts as arrived at its target.

use plumb_protocol::config::Reached;
use plumb_protocol::dimension::{AXES, PerAxis};
use plumb_protocol::units::{Micros, Point};

use crate::vector::per_axis;

/// Largest plausible move of the ball along an axis between two positions, µm. At 400 steps/s and
/// 0.94 mm a step the ball moves 12.5 mm between two frames, and noise of 6 mm reaches the rest at
/// four standard deviations.
const MAX_MOVE_UM: i32 = 25_000;

/// Outliers in a row that the filter passes over. It takes in the next position: the ball has
/// moved.
const MAX_OUTLIERS: u8 = 2;

/// Tracker of the ball: its last position, and a filter over all positions.
///
/// The filter is of first order: each position moves it a quarter of the way. It lets 0.38 of white
/// noise through (√(a/(2 - a)), a = 1/4) and lags by three positions. It passes over single
/// outliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BallTracker {
    /// When the last frame with the ball inside the workspace was captured.
    captured: Option<Micros>,
    /// Position of the ball in it, µm.
    last: Option<PerAxis<i32>>,
    /// Frames in a row with the ball outside the workspace.
    outside: u8,
    /// State of the filter: µm with 4 fraction bits; within ±4 m, so 26 bits.
    state: Option<PerAxis<i32>>,
    /// Last position that the filter took in, µm.
    inlier: PerAxis<i32>,
    /// Positions in a row that the filter passed over.
    outliers: u8,
}

impl BallTracker {
    /// Takes in a position inside the workspace and within ±4 m, µm, from a frame captured at
    /// `captured`. The filter starts at the first position.
    pub fn update(&mut self, captured: Micros, position: PerAxis<i32>) {
        (self.captured, self.last) = (Some(captured), Some(position));
        self.outside = 0;
        if self.is_outlier(position) {
            self.outliers += 1;
            return;
        }
        (self.inlier, self.outliers) = (position, 0);
        let position = position.map(|p| p << 4);
        self.state = Some(match self.state {
            None => position,
            Some(state) => per_axis(|i| state[i] + ((position[i] - state[i]) >> 2)),
        });
    }

    fn is_outlier(&self, position: PerAxis<i32>) -> bool {
        let far = (0..AXES).any(|i| (position[i] - self.inlier[i]).abs() > MAX_MOVE_UM);
        self.state.is_some() && far && self.outliers < MAX_OUTLIERS
    }

    /// Returns when the last frame with the ball was captured.
    pub fn captured(&self) -> Option<Micros> {
        self.captured
    }

    /// Returns the last position, µm, unfiltered.
    pub fn last(&self) -> Option<PerAxis<i32>> {
        self.last
    }

    /// Returns the filtered position in whole micrometres; `None` before the first position.
    pub fn filtered(&self) -> Option<PerAxis<i32>> {
        self.state.map(|s| s.map(|p| (p + 8) >> 4))
    }

    /// Returns the residual: the last position that the filter took in less the filtered one, µm,
    /// within ±8 m; zero before the first position.
    pub fn residual(&self) -> PerAxis<i32> {
        self.filtered().map_or([0; AXES], |p| per_axis(|i| self.inlier[i] - p[i]))
    }

    /// Counts a frame with the ball outside the workspace. Returns the number of such frames in a
    /// row.
    pub fn count_outside(&mut self) -> u8 {
        self.outside = self.outside.saturating_add(1);
        self.outside
    }

    /// Forgets the frames with the ball outside the workspace.
    pub fn clear_outside(&mut self) {
        self.outside = 0;
    }
}

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
    residual: PerAxis<i32>,
    /// Mean product of two residuals in a row, µm².
    swing: i64,
}

impl ArrivalDetector {
    /// Takes in the filtered |e| after a position (`filtered`, µm) and the residual of that
    /// position ([`BallTracker::residual`]). Returns whether the target counts as reached now.
    pub fn update(&mut self, filtered: u32, residual: PerAxis<i32>, rule: &Reached) -> bool {
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
    fn update_swing(&mut self, residual: PerAxis<i32>, radius: u32) {
        let most = i64::from(radius) * i64::from(radius) / 2;
        let product: i64 =
            (0..AXES).map(|i| i64::from(residual[i]) * i64::from(self.residual[i])).sum();
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

/// Returns e = `position` - `target`, µm; both within ±4 m a coordinate.
pub fn error(position: PerAxis<i32>, target: Point) -> PerAxis<i32> {
    let target = target.micrometres();
    per_axis(|i| position[i] - target[i])
}

/// Returns |e| in whole micrometres, rounded down; e within ±8 m a coordinate, so 24 bits.
pub fn magnitude(e: PerAxis<i32>) -> u32 {
    let squares: u64 = e.iter().map(|c| u64::from(c.unsigned_abs()).pow(2)).sum();
    squares.isqrt() as u32
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::{Micrometres, Micros};

    use super::super::{BallTracker, magnitude};
    use super::*;

    #[test]
    fn outliers_are_passed_over_and_a_true_jump_is_not() {
        let mut tracker = BallTracker::default();
        let (home, away) = ([0, 0, -500_000], [0, 50_000, -500_000]);
        for ball in [home, home, away, home, away, away, home] {
            tracker.update(Micros(0), ball);
            assert_eq!(tracker.filtered(), Some(home));
        }
        for _ in 0..30 {
            tracker.update(Micros(0), away);
        }
        assert!(tracker.filtered().is_some_and(|p| (p[1] - away[1]).abs() < 100));
    }

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
