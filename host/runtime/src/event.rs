//! Events of a run, in the words that every output has.

use std::fmt;

use nalgebra::Point3;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use thiserror::Error;

use crate::board_fault::BoardFault;
use crate::doubt::Doubt;
use crate::operator::{CommandOutcome, OperatorCommand, StopEvent};
use crate::rig::MotionError;
use crate::rounding::round;
use crate::stop_reason::StopReason;

/// An event, and when it happened.
///
/// As JSON: `time_s`, `kind`, `number`, `target_m` (`null` where there is none), `ok`, `text` (that
/// of its `Display`) and `advice` (`null` without a fault).
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// When it happened, seconds since the run's start; 0 before the first frame.
    pub time: f64,
    /// The event.
    pub event: RunEvent,
}

/// Event of a run between two frames. Its text is for people.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum RunEvent {
    /// The board received a new target: the drive to it is a leg of the summary.
    TargetSet {
        /// Number of the leg, from 0.
        number: usize,
        /// The target, metres in the rig frame.
        target: Point3<f64>,
    },
    /// The drive to a target ended. A failure of the link or the camera has no such event; the
    /// summary has its message.
    TargetEnded {
        /// Number of the leg, from 0.
        number: usize,
        /// Reason of its end.
        reason: StopReason,
    },
    /// A frame was lost, or the detector could not search the frame of the record before. The run
    /// log lists these events in `lost.csv`.
    FrameLost {
        /// Message of the error.
        message: String,
    },
    /// A command of the operator was carried out or refused.
    Command {
        /// Number of the command, from [`OperatorSender::send`](crate::operator::OperatorSender).
        number: u64,
        /// The command.
        command: OperatorCommand,
        /// Its outcome.
        outcome: CommandOutcome,
    },
    /// The board stopped by itself while it drove to no target: it was holding or at rest. During a
    /// drive, [`TargetEnded`](Self::TargetEnded) has the fault.
    BoardStopped {
        /// Reason.
        fault: BoardFault,
    },
    /// Something happened with [targets that move](crate::targets).
    Targets(TargetsEvent),
    /// A Stop of an operator holds, or holds no longer.
    Stop(StopEvent),
    /// The measured positions cannot be believed.
    Doubt(Doubt),
}

/// Event of targets that move. Its text is for people.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TargetsEvent {
    /// Something of the source was left out, for this reason.
    #[error("targets: {0}")]
    LeftOut(String),
    /// The target is in a place that the rig does not allow. The ball stays at the last good one.
    /// At most one event a second.
    #[error(
        "target [{:.4}, {:.4}, {:.4}] m: {error}; it is left out",
        position.x, position.y, position.z
    )]
    Refused {
        /// Place, metres in the rig frame.
        position: Point3<f64>,
        /// Broken rule.
        error: MotionError,
    },
    /// The ball has been far from the target for seconds while the target moved on.
    #[error(
        "targets: the ball lags far behind (is the target faster than the motors or \
         `path.max_speed` of the rig file allow, or the link to the board slow?)"
    )]
    Lagging,
    /// Targets have come for seconds, and the board has followed none of them.
    #[error(
        "targets: they come, and the board follows none, since it does not know where the ball is: \
         is it in view?"
    )]
    NotFollowed,
    /// No target that can be used has come for a second. The target has come to rest beyond its
    /// last place.
    #[error(
        "targets: none that can be used for a second; the ball goes to where the target came to \
         rest, and waits"
    )]
    Ceased,
    /// Targets come again.
    #[error("targets: they come again")]
    Resumed,
    /// No target follows.
    #[error("targets: no more come")]
    Ended,
}

/// Kind of an event. As JSON its name in snake_case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum EventKind {
    /// The board received a new target.
    TargetSet,
    /// The drive to a target ended.
    TargetEnded,
    /// A frame was lost or could not be searched.
    FrameLost,
    /// A command of the operator was carried out or refused.
    Command,
    /// The board stopped by itself, without a target.
    BoardStopped,
    /// Something happened with targets that move.
    Targets,
    /// A Stop of an operator holds, or holds no longer.
    Stop,
    /// The measured positions cannot be believed.
    Doubt,
}

/// How an event went, for its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tone {
    /// Something went as it should.
    Good,
    /// Something happened.
    Note,
    /// Something failed or was refused.
    Bad,
}

impl RunEvent {
    /// Returns the kind of the event.
    pub fn kind(&self) -> EventKind {
        match self {
            Self::TargetSet { .. } => EventKind::TargetSet,
            Self::TargetEnded { .. } => EventKind::TargetEnded,
            Self::FrameLost { .. } => EventKind::FrameLost,
            Self::Command { .. } => EventKind::Command,
            Self::BoardStopped { .. } => EventKind::BoardStopped,
            Self::Targets(_) => EventKind::Targets,
            Self::Stop(_) => EventKind::Stop,
            Self::Doubt(_) => EventKind::Doubt,
        }
    }

    /// Returns how the event went.
    pub fn tone(&self) -> Tone {
        match self {
            Self::TargetEnded { reason, .. } if reason.is_arrival() => Tone::Good,
            Self::Command { outcome: CommandOutcome::Accepted, .. }
            | Self::Stop(StopEvent::Resumed { .. }) => Tone::Good,
            Self::TargetEnded { .. }
            | Self::Command { .. }
            | Self::FrameLost { .. }
            | Self::BoardStopped { .. }
            | Self::Doubt(_)
            | Self::Targets(TargetsEvent::Refused { .. })
            | Self::Stop(StopEvent::Refused { .. }) => Tone::Bad,
            Self::TargetSet { .. } | Self::Targets(_) | Self::Stop(_) => Tone::Note,
        }
    }

    /// Returns the number of the leg, the command or the Stop that the event is about.
    pub fn number(&self) -> Option<u64> {
        match self {
            Self::TargetSet { number, .. } | Self::TargetEnded { number, .. } => {
                u64::try_from(*number).ok()
            }
            Self::Command { number, .. } => Some(*number),
            Self::Stop(event) => Some(event.stop()),
            Self::FrameLost { .. }
            | Self::BoardStopped { .. }
            | Self::Targets(_)
            | Self::Doubt(_) => None,
        }
    }

    /// Returns the target that the event is about, metres in the rig frame.
    pub fn target(&self) -> Option<Point3<f64>> {
        match self {
            Self::TargetSet { target, .. }
            | Self::Command { command: OperatorCommand::Target(target), .. } => Some(*target),
            Self::Targets(TargetsEvent::Refused { position, .. }) => Some(*position),
            _ => None,
        }
    }

    /// Returns the fault for which the board has stopped by itself.
    pub fn fault(&self) -> Option<BoardFault> {
        match self {
            Self::BoardStopped { fault } => Some(*fault),
            Self::TargetEnded { reason, .. } => reason.fault(),
            _ => None,
        }
    }
}

impl fmt::Display for RunEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TargetSet { target, .. } => {
                write!(f, "target set: ({:.3}, {:.3}, {:.3}) m", target.x, target.y, target.z)
            }
            Self::TargetEnded { reason, .. } => write!(f, "target: {reason}"),
            Self::FrameLost { message } => write!(f, "a picture was lost: {message}"),
            Self::Command { command, outcome: CommandOutcome::Accepted, .. } => {
                write!(f, "{command}: accepted")
            }
            Self::Command { command, outcome: CommandOutcome::Refused(refusal), .. } => {
                write!(f, "{command}: {refusal}")
            }
            Self::BoardStopped { fault } => write!(f, "the board has stopped by itself: {fault}"),
            Self::Targets(event) => event.fmt(f),
            Self::Stop(event) => event.fmt(f),
            Self::Doubt(doubt) => f.write_str(&doubt.with_advice()),
        }
    }
}

impl Serialize for EventRecord {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { time, event } = self;
        let target = event.target().map(|at| <[f64; 3]>::from(at).map(|metres| round(metres, 1e6)));
        let mut fields = serializer.serialize_struct("EventRecord", 7)?;
        fields.serialize_field("time_s", &round(*time, 1e6))?;
        fields.serialize_field("kind", &event.kind())?;
        fields.serialize_field("number", &event.number())?;
        fields.serialize_field("target_m", &target)?;
        fields.serialize_field("ok", &(event.tone() != Tone::Bad))?;
        fields.serialize_field("text", &event.to_string())?;
        fields.serialize_field("advice", &event.fault().map(|fault| fault.advice()))?;
        fields.end()
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::message::Fault;

    use super::*;
    use crate::operator::CommandRefusal;
    use crate::rig::{Outside, Side};

    fn json(event: RunEvent) -> serde_json::Value {
        serde_json::to_value(EventRecord { time: 1.5, event }).unwrap()
    }

    #[test]
    fn an_event_names_its_kind_its_target_and_its_outcome() {
        let command = OperatorCommand::Target(Point3::new(0.4, 0.3, 7.0));
        let outcome = CommandOutcome::Refused(CommandRefusal::TargetOutside(Outside {
            axis: 'z',
            value_m: 7.0,
            side: Side::Above,
            limit_m: 0.6,
            unit: None,
        }));
        let got = json(RunEvent::Command { number: 3, command, outcome });
        let expected = serde_json::json!({
            "time_s": 1.5, "kind": "command", "number": 3, "target_m": [0.4, 0.3, 7.0], "ok": false,
            "text": "go to (0.400, 0.300, 7.000) m: the target is outside the workspace of the rig \
                     file: z = 7 m is above the 0.6 m of `workspace.max`",
            "advice": null,
        });
        assert_eq!(got, expected);
        let got = json(RunEvent::TargetEnded { number: 1, reason: StopReason::Reached });
        assert_eq!((&got["kind"], &got["ok"]), (&"target_ended".into(), &true.into()));
    }

    #[test]
    fn a_fault_has_its_advice_during_a_drive_and_outside() {
        let fault = BoardFault::from(Fault::BallOutside);
        let reason = StopReason::Fault(fault);
        let events =
            [RunEvent::BoardStopped { fault }, RunEvent::TargetEnded { number: 0, reason }];
        for event in events {
            let got = json(event);
            assert_eq!((&got["advice"], &got["ok"]), (&fault.advice().into(), &false.into()));
        }
    }
}
