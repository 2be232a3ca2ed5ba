//! Conditions that the board checks while it moves: a reached target, deadlines, guards.

use plumb_protocol::config::{Deadlines, Following, Growth, Progress, Reached};
use plumb_protocol::units::{Micrometres, Milliseconds, Steps16};
use serde::Deserialize;

use super::quantity::{Conversion, Deadline, Distance, Movement, ProgressTime, Turn, frames};

/// Rule by which a target counts as reached. See [`plumb_protocol::config::Reached`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReachedRule {
    /// Distance, metres.
    pub radius: Distance,
    /// Number of consecutive frames.
    #[serde(deserialize_with = "frames")]
    pub frames: u8,
}

/// Times after which the board stops by itself, seconds. See
/// [`plumb_protocol::config::Deadlines`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeadlineSettings {
    /// Without a frame from the host.
    pub host: Deadline,
    /// Without a fresh position.
    pub position: Deadline,
    /// Greatest age of a frame that is used, seconds; below `position`.
    pub max_age: Deadline,
}

/// Rule by which a growing error stops the board. See [`plumb_protocol::config::Growth`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GrowthRule {
    /// Metres above the least |e|.
    pub margin: Distance,
    /// For so long, seconds.
    pub time: Deadline,
}

/// Rule by which motors that turn without the ball stop the board. See
/// [`plumb_protocol::config::Following`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FollowingRule {
    /// Turn of a motor, full steps.
    pub turn: Turn,
    /// Movement of the ball, metres.
    pub movement: Movement,
}

/// Rule by which a ball that gets no nearer to its target stops the board. See
/// [`plumb_protocol::config::Progress`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ProgressRule {
    /// Metres below the least |e| so far.
    pub margin: Distance,
    /// Time without it, seconds.
    pub time: ProgressTime,
}

impl Default for ReachedRule {
    /// Returns 4 pictures at least within 10 mm, the paper's threshold.
    fn default() -> Self {
        Self { radius: Distance::constant(0.010), frames: 4 }
    }
}

impl Default for DeadlineSettings {
    /// Returns deadlines for a camera of 30 pictures/s: 9 pictures without a frame from the host,
    /// 15 without a position.
    fn default() -> Self {
        Self {
            host: Deadline::constant(0.3),
            position: Deadline::constant(0.5),
            max_age: Deadline::constant(0.25),
        }
    }
}

impl Default for GrowthRule {
    /// Returns four times the default radius of a reached target, for 6 pictures at 30 pictures/s.
    fn default() -> Self {
        Self { margin: Distance::constant(0.04), time: Deadline::constant(0.2) }
    }
}

impl Default for FollowingRule {
    /// Returns a turn of 400 steps: 300 stop no healthy rig (docs/understand/board.md).
    fn default() -> Self {
        Self { turn: Turn::constant(400.0), movement: Movement::constant(0.02) }
    }
}

impl Default for ProgressRule {
    /// Returns a time of 10 s: 5 s stop no healthy rig.
    fn default() -> Self {
        Self { margin: Distance::constant(0.001), time: ProgressTime::constant(10.0) }
    }
}

impl ReachedRule {
    pub(super) fn convert(&self, conversion: &mut Conversion) -> Reached {
        let radius = self.radius.get();
        let radius = conversion.fit("reached.radius", radius, Micrometres::from_si);
        Reached { radius, frames: self.frames }
    }
}

impl DeadlineSettings {
    pub(super) fn convert(&self, conversion: &mut Conversion) -> Deadlines {
        let mut fit =
            |key, value: Deadline| conversion.fit(key, value.get(), Milliseconds::from_si);
        let deadlines = Deadlines {
            host: fit("deadlines.host", self.host),
            position: fit("deadlines.position", self.position),
            max_age: fit("deadlines.max_age", self.max_age),
        };
        if self.max_age >= self.position {
            let why = "is not below `deadlines.position`: the board would drive on \
                       positions that are older than that deadline";
            conversion.report("deadlines.max_age", self.max_age.get(), why);
        }
        deadlines
    }
}

impl GrowthRule {
    pub(super) fn convert(&self, conversion: &mut Conversion) -> Growth {
        Growth {
            margin: conversion.fit("growth.margin", self.margin.get(), Micrometres::from_si),
            time: conversion.fit("growth.time", self.time.get(), Milliseconds::from_si),
        }
    }
}

impl FollowingRule {
    pub(super) fn convert(&self, conversion: &mut Conversion) -> Following {
        let (turn, movement) = (self.turn.get(), self.movement.get());
        Following {
            turn: conversion.fit("following.turn", turn, Steps16::from_si),
            movement: conversion.fit("following.movement", movement, Micrometres::from_si),
        }
    }
}

impl ProgressRule {
    pub(super) fn convert(&self, conversion: &mut Conversion) -> Progress {
        Progress {
            margin: conversion.fit("progress.margin", self.margin.get(), Micrometres::from_si),
            time: conversion.fit("progress.time", self.time.get(), Milliseconds::from_si),
        }
    }
}
