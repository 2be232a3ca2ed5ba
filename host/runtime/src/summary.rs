//! Counts and measurements of a run, and its summary.

use serde::Serialize;

use crate::deviation::PathSummary;
use crate::event::EventRecord;
use crate::stop_reason::StopReason;
use crate::targets_summary::TargetsSummary;
use crate::wakeups::LateWakeups;

/// Counts and measurements of a run so far, over all targets.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RunStats {
    /// Time stamp of the first frame, seconds on the source's clock.
    pub(crate) start: Option<f64>,
    /// Number of frames.
    pub(crate) frames: u64,
    /// Number of frames in which the ball was found and located.
    pub(crate) located: u64,
    /// Number of frames that were lost or could not be searched.
    pub(crate) lost: u64,
    /// Number of frames that a newer one replaced before the detector was free.
    pub(crate) skipped: u64,
    /// |e| of the filtered position to the present target, as the board last reported it, metres.
    pub(crate) error: Option<f64>,
    /// Time stamp of the last frame, seconds since the first.
    pub(crate) time: f64,
}

/// Result of a run: `summary.json`, and the last line of `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Whether every target of the list and of the operator was reached.
    pub reached: bool,
    /// Whether every target was reached, or the ball hung there already.
    #[serde(skip)]
    pub is_done: bool,
    /// Name of the control law.
    pub law: &'static str,
    /// Name of the detector.
    pub detector: &'static str,
    /// Number of frames.
    pub frames: u64,
    /// Time from the first frame to the last, seconds on the source's clock.
    pub time_s: f64,
    /// The board's filtered |e| at the end, millimetres; absent if it never reported one.
    pub filtered_error_mm: Option<f64>,
    /// Number of targets that were reached.
    pub targets_reached: usize,
    /// The targets of the run so far, in order; of more than 1000 the first 100 and the last 900.
    pub legs: Vec<Leg>,
    /// Number of targets between these two parts; left out where it is 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub legs_left_out: u64,
    /// What happened, in order, but for lost frames; of more than 1000 events the first 100 and the
    /// last 900.
    pub events: Vec<EventRecord>,
    /// Number of events between these two parts; left out where it is 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub events_left_out: u64,
    /// How the ball followed a path; left out where it followed none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<PathSummary>,
    /// How the ball followed targets that move; left out where it followed none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<TargetsSummary>,
    /// Whether the board reported at the end that its motors stand still.
    pub at_rest: bool,
    /// Number of frames in which the ball was found and located.
    pub located: u64,
    /// Number of frames that were lost or could not be searched.
    pub lost: u64,
    /// Number of frames from the first target to the end that a newer one replaced before the
    /// detector was free; left out where it is 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub skipped: u64,
    /// Late wake-ups of this program; left out where there was none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub late_wakeups: Option<LateWakeups>,
    /// Number of positions that the board refused.
    pub refused_positions: u32,
    /// Reason of the end. A fault of the board is the reason also where the link broke after it.
    pub ending: StopReason,
    /// Message of the error that broke the run, where `ending` is a fault; left out otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Number of records that outputs (the run log, the recording) had no room for; left out where
    /// it is 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub dropped_records: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Result of the drive to one target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leg {
    /// The target, metres in the rig frame.
    pub target_m: [f64; 3],
    /// Number of frames.
    pub frames: u64,
    /// Whether the target was reached.
    pub reached: bool,
    /// Reason of the end of the drive.
    pub ending: StopReason,
    /// The board's filtered |e| at the end of the leg, millimetres; absent if the board reported
    /// none, or the ball was never located.
    pub filtered_error_mm: Option<f64>,
}
