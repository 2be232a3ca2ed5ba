//! Targets as the control loop takes them, from any source.

use nalgebra::{Point3, Vector3};
use serde::Serialize;

/// Number of a motion: targets that belong together, such as those of one program or one gesture.
/// The run follows the newest motion. A Stop ends those that were begun before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct MotionId(pub(super) u64);

/// Place of a target at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedTarget {
    /// The motion that it belongs to. A target of an older motion than the last one is left out.
    pub motion: MotionId,
    /// Time, seconds on the clock of the pictures.
    pub time: f64,
    /// Place, metres in the rig frame.
    pub position: Point3<f64>,
    /// Velocity, m/s, where it is known.
    pub velocity: Option<Vector3<f64>>,
}

/// What a source of targets left out so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct LeftOut {
    /// Lines or messages that are not as documented.
    pub unreadable: u64,
    /// Targets that were told after newer ones.
    pub out_of_order: u64,
    /// Targets that were older than [`MAX_AGE_S`](super::MAX_AGE_S) when they came, or whose time
    /// is unknown.
    pub late: u64,
    /// Targets that newer ones replaced before the control loop took them.
    pub skipped: u64,
}

/// Targets and messages that have come.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Arrivals {
    /// Targets, in the order of their arrival.
    pub targets: Vec<TimedTarget>,
    /// Reasons why targets were left out, for people.
    pub problems: Vec<String>,
    /// What was left out since the beginning.
    pub left_out: LeftOut,
    /// How the source ended; `None` while more may come.
    pub end: Option<SourceEnd>,
}

/// How a source of targets ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceEnd {
    /// All its targets have come.
    Complete,
    /// It could not be read on: its lines are no targets, or their times are unknown.
    Broken,
}

/// Source of a target that moves.
pub trait TargetSource {
    /// Removes and returns what has come until `now`, seconds on the clock of the pictures. Returns
    /// at once.
    fn take(&mut self, now: f64) -> Arrivals;

    /// Returns the newest motion that was begun.
    fn newest_motion(&self) -> MotionId;

    /// Ends the motions that were begun until now. Returns the newest of them. A source whose
    /// senders ask for it ([`TargetSender::has_ended`](super::TargetSender::has_ended)) notes it.
    fn cancel(&mut self) -> MotionId {
        self.newest_motion()
    }
}
