//! Damping of a loop that overshoots its target again and again.

use crate::law::overshoot::OvershootDetector;
use crate::law::sign;

/// Overshoots of a target that do not reduce the gain.
const FREE_OVERSHOOTS: u8 = 1;
/// Factor on the gain at each further overshoot, Q8.
const DAMPING: u32 = 192;
/// Rise of the scale with each measurement while the target moves, Q8: from the least to 1 in 8 s.
const RECOVERY: u32 = 1;
/// Least scale of the gain, Q8.
const MIN_GAIN_SCALE: u32 = 26;

/// Scale of the gain on the way to a target: less after each overshoot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OvershootDamping {
    target: [i32; 3],
    detector: OvershootDetector,
    overshoots: u8,
    /// Q8.
    gain_scale: u32,
}

impl OvershootDamping {
    /// Creates the damping on the way to `target` (µm).
    pub(super) fn new(target: [i32; 3]) -> Self {
        Self { target, detector: OvershootDetector::default(), overshoots: 0, gain_scale: 256 }
    }

    /// Goes on with a target that has moved to `target` (µm). Meanwhile the scale rises again.
    pub(super) fn follow(&mut self, target: [i32; 3]) {
        self.target = target;
        self.gain_scale = (self.gain_scale + RECOVERY).min(256);
    }

    /// Takes the predicted error `e` (µm), and returns the scale of the rates, Q8. Another target
    /// starts afresh.
    pub(super) fn update(&mut self, target: [i32; 3], e: [i32; 3]) -> u32 {
        if self.target != target {
            *self = Self::new(target);
        }
        if self.detector.overshoots(e, sign::distance(e)) {
            self.overshoots = self.overshoots.saturating_add(1);
            if self.overshoots > FREE_OVERSHOOTS {
                self.gain_scale = ((self.gain_scale * DAMPING) >> 8).max(MIN_GAIN_SCALE);
            }
        }
        self.gain_scale
    }
}
