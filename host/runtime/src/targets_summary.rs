//! Summary of targets that moved.

use std::fmt;

use serde::Serialize;

use crate::deviation::{Spread, Spreads};
use crate::targets::LeftOut;

/// How the ball followed targets that move.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TargetsSummary {
    /// Number of targets that were taken.
    pub taken: u64,
    /// Number of targets in places that the rig does not allow.
    pub refused: u64,
    /// Number of targets that came after a command had ended their motion.
    pub ended: u64,
    /// Targets that were left out.
    #[serde(flatten)]
    pub left_out: LeftOut,
    /// Number of times that no target came for a second.
    pub pauses: u64,
    /// Number of pictures with the ball while the board followed the targets or held the ball where
    /// they rest.
    pub followed: u64,
    /// Number of those of them with the ball at the target, within the radius of a reached one, and
    /// no newer target that was left out.
    pub near: u64,
    /// Distances of the measured ball from the target at the time of the picture, since the ball
    /// had caught up: it had been there for a quarter of a second. Left out where it had not.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub spreads: Option<Spreads>,
}

/// As a line for people.
impl fmt::Display for TargetsSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LeftOut { unreadable, out_of_order, late, skipped } = self.left_out;
        write!(f, "targets: {} taken", self.taken)?;
        let counts = [
            (self.refused, "refused"),
            (unreadable, "unreadable"),
            (out_of_order, "out of order"),
            (late, "too late or with a wrong time"),
            (skipped, "skipped (too early, or too many at once: a file: plumb follow FILE)"),
            (self.ended, "after the end of their motion"),
        ];
        for (count, name) in counts.into_iter().filter(|(count, _)| *count > 0) {
            write!(f, ", {count} {name}")?;
        }
        if self.taken == 0 {
            return Ok(());
        }
        if self.followed == 0 {
            return write!(f, "; the board followed none of them");
        }
        write!(f, "; the ball was at its target in {} of {} pictures", self.near, self.followed)?;
        let Some(Spreads { frames, error, .. }) = self.spreads else {
            return match self.near {
                0 => write!(f, ", and did not catch up"),
                _ => write!(f, ", and never for a quarter of a second"),
            };
        };
        let Spread { rms_mm, p99_mm, max_mm } = error;
        write!(
            f,
            "; since it has caught up, its distance was {rms_mm:.1} mm rms, at most {p99_mm:.1} mm \
             in 99 % of {frames} pictures, and at most {max_mm:.1} mm"
        )
    }
}
