//! Progress towards a target: damps a loop that swings, and detects filters that are stuck.

use super::geometry::{Vector, dot, length, scaled};

/// Least amplitude of a swing past the target, mm: above the noise of the estimate (below 1 for
/// measurements with 2, 1, 1 mm), and well below a radius of 10 mm.
const MIN_SWING_MM: f32 = 4.0;
/// Swings that do not reduce the pace.
const FREE_SWINGS: u8 = 1;
/// Factor on the pace at each further swing.
const DAMPING: f32 = 0.4;
/// Least pace. With a gain of 12/s times this, a loop without further delay is stable about a mode
/// of 0.6 Hz and ζ = 0.02: the gain is below 2 ζ ω.
const MIN_PACE: f32 = 0.012;
/// Measurements in a window whose mean error is judged. The mean: a ball that swings about its
/// target is not stuck.
const WINDOW: u8 = 45;
/// Least decrease of the mean error from window to window, mm; with less the filters are stuck.
const MIN_PROGRESS_MM: f32 = 3.0;
/// Mean error below which progress is not required, mm.
const NEAR_MM: f32 = 6.0;
/// Factor on the pace after a window without a swing, while the target is not near: the swinging is
/// over.
const RECOVERY: f32 = 2.0;

/// Factor on the pace with each measurement while the target moves: a swing is forgotten in 1.5 s.
const FOLLOWING_RECOVERY: f32 = 1.02;

/// Monitors the error on the way to one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProgressMonitor {
    /// Target, mm.
    target: Vector,
    /// Largest error on the present side of the target, mm.
    side: Vector,
    /// Swings so far.
    swings: u8,
    /// Swings at the beginning of the window.
    swings_before: u8,
    pace: f32,
    /// Measurements in the window.
    count: u8,
    /// Sum of their errors, mm.
    sum: Vector,
    /// Length of the mean error of the last window, mm.
    mean_before: f32,
}

impl ProgressMonitor {
    /// Creates the monitor on the way to `target` (mm).
    pub(super) fn new(target: Vector) -> Self {
        Self {
            target,
            side: [0.0; 3],
            swings: 0,
            swings_before: 0,
            pace: 1.0,
            count: 0,
            sum: [0.0; 3],
            mean_before: f32::MAX,
        }
    }

    /// Returns the factor on the gain, [`MIN_PACE`] to 1. It falls with each swing past the target:
    /// such a loop is too quick for what the filters do not model, and springs come to rest on a
    /// slower one. It rises again while a ball without swings is still on its way.
    pub(super) fn pace(&self) -> f32 {
        self.pace
    }

    /// Goes on with a target that has moved to `target` (mm). Meanwhile the pace rises again.
    pub(super) fn follow(&mut self, target: Vector) {
        self.target = target;
        self.pace = (FOLLOWING_RECOVERY * self.pace).min(1.0);
    }

    /// Takes the error (mm) on the way to `target`, and returns whether the filters are stuck.
    pub(super) fn update(&mut self, target: Vector, e: Vector) -> bool {
        if target != self.target {
            *self = Self::new(target);
        }
        self.count_swings(e);
        self.count += 1;
        self.sum = [0, 1, 2].map(|i| self.sum[i] + e[i]);
        if self.count < WINDOW {
            return false;
        }
        let mean = length(scaled(self.sum, 1.0 / f32::from(WINDOW)));
        let stuck = mean > NEAR_MM && mean > self.mean_before - MIN_PROGRESS_MM;
        if mean > NEAR_MM && self.swings == self.swings_before {
            self.pace = (RECOVERY * self.pace).min(1.0);
        }
        self.swings_before = self.swings;
        (self.count, self.sum, self.mean_before) = (0, [0.0; 3], mean);
        stuck
    }

    fn count_swings(&mut self, e: Vector) {
        if dot(e, self.side) < 0.0 {
            if length(e) < MIN_SWING_MM {
                return;
            }
            self.side = e;
            self.swings = self.swings.saturating_add(1);
            if self.swings > FREE_SWINGS {
                self.pace = (DAMPING * self.pace).max(MIN_PACE);
            }
        } else if dot(e, e) > dot(self.side, self.side) {
            self.side = e;
        }
    }
}
