//! The ball's position over time, with noise and outliers.

use plumb_protocol::units::Micros;

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
    last: Option<[i32; 3]>,
    /// Frames in a row with the ball outside the workspace.
    outside: u8,
    /// State of the filter: µm with 4 fraction bits; within ±4 m, so 26 bits.
    state: Option<[i32; 3]>,
    /// Last position that the filter took in, µm.
    inlier: [i32; 3],
    /// Positions in a row that the filter passed over.
    outliers: u8,
}

impl BallTracker {
    /// Takes in a position inside the workspace and within ±4 m, µm, from a frame captured at
    /// `captured`. The filter starts at the first position.
    pub fn update(&mut self, captured: Micros, position: [i32; 3]) {
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
            Some(state) => [0, 1, 2].map(|i| state[i] + ((position[i] - state[i]) >> 2)),
        });
    }

    fn is_outlier(&self, position: [i32; 3]) -> bool {
        let far = (0..3).any(|i| (position[i] - self.inlier[i]).abs() > MAX_MOVE_UM);
        self.state.is_some() && far && self.outliers < MAX_OUTLIERS
    }

    /// Returns when the last frame with the ball was captured.
    pub fn captured(&self) -> Option<Micros> {
        self.captured
    }

    /// Returns the last position, µm, unfiltered.
    pub fn last(&self) -> Option<[i32; 3]> {
        self.last
    }

    /// Returns the filtered position in whole micrometres; `None` before the first position.
    pub fn filtered(&self) -> Option<[i32; 3]> {
        self.state.map(|s| s.map(|p| (p + 8) >> 4))
    }

    /// Returns the residual: the last position that the filter took in less the filtered one, µm,
    /// within ±8 m; zero before the first position.
    pub fn residual(&self) -> [i32; 3] {
        self.filtered().map_or([0; 3], |p| [0, 1, 2].map(|i| self.inlier[i] - p[i]))
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

#[cfg(test)]
mod tests {
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
}
