//! Events of a run as messages.

use plumb_runtime::observer::RunEvent;
use plumb_runtime::operator::{CommandOutcome, OperatorCommand, StopEvent};
use plumb_runtime::run::StopReason;
use serde::Serialize;

use crate::message::EventMessage;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Kind {
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
    /// A Stop of an operator holds, or holds no longer.
    Stop,
    /// A kind that has no name here.
    Other,
}

/// Returns the message of an event that came `time_s` seconds after the run's start.
pub(crate) fn message(time_s: f64, event: &RunEvent) -> EventMessage {
    let new = |kind, number, ok, text| EventMessage {
        time_s,
        kind,
        number,
        target_m: target(event),
        ok,
        text,
    };
    match event {
        RunEvent::TargetSet { number, target } => {
            let text = format!("target set: ({:.3}, {:.3}, {:.3}) m", target.x, target.y, target.z);
            new(Kind::TargetSet, Some(*number as u64), true, text)
        }
        RunEvent::TargetEnded { number, reason } => {
            let reached = *reason == StopReason::Reached;
            let text = format!("target: {reason}");
            new(Kind::TargetEnded, Some(*number as u64), reached, text)
        }
        RunEvent::FrameLost { message } => {
            new(Kind::FrameLost, None, false, format!("a picture was lost: {message}"))
        }
        RunEvent::Command { number, command, outcome } => {
            let (ok, text) = match outcome {
                CommandOutcome::Accepted => (true, format!("{command}: accepted")),
                CommandOutcome::Refused(refusal) => (false, format!("{command}: {refusal}")),
            };
            new(Kind::Command, Some(*number), ok, text)
        }
        RunEvent::BoardStopped { fault } => {
            let text = format!("the board has stopped by itself: {fault}");
            new(Kind::BoardStopped, None, false, text)
        }
        RunEvent::Stop(event) => new(Kind::Stop, stop_number(event), true, event.to_string()),
        other => new(Kind::Other, None, true, format!("{other:?}")),
    }
}

/// Returns the number of the Stop that an event is about.
fn stop_number(event: &StopEvent) -> Option<u64> {
    match event {
        StopEvent::Stopped(stop) | StopEvent::Resumed { stop, .. } => Some(stop.number),
        StopEvent::Refused { number, .. } => Some(*number),
        _ => None,
    }
}

/// Returns the target that an event is about.
fn target(event: &RunEvent) -> Option<[f64; 3]> {
    match event {
        RunEvent::TargetSet { target, .. }
        | RunEvent::Command { command: OperatorCommand::Target(target), .. } => {
            Some((*target).into())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use plumb_runtime::operator::CommandRefusal;

    use super::*;

    #[test]
    fn an_event_names_its_kind_its_target_and_its_outcome() {
        let command = OperatorCommand::Target(Point3::new(0.4, 0.3, 7.0));
        let outcome = CommandOutcome::Refused(CommandRefusal::TargetOutside);
        let got = message(1.5, &RunEvent::Command { number: 3, command, outcome });
        let json = serde_json::to_value(&got).unwrap();
        assert_eq!(json["kind"], "command");
        assert_eq!((got.number, got.ok, got.target_m), (Some(3), false, Some([0.4, 0.3, 7.0])));
        assert!(got.text.starts_with("go to (0.400, 0.300, 7.000) m: the target is outside"));

        let reached = RunEvent::TargetEnded { number: 1, reason: StopReason::Reached };
        let got = message(2.0, &reached);
        assert_eq!((got.kind, got.ok, got.number), (Kind::TargetEnded, true, Some(1)));
    }
}
