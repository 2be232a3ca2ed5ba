//! Faults are reported, latched, and cleared at standstill only.

use plumb_protocol::message::{Command, Fault, FromBoard};

use super::super::event::{Cut, Delivery, Snapshot, Ticked};
use crate::campaign::Outcome;

/// A fault stays until a ClearFault; only an emergency stop replaces it. The invariant of
/// standstill covers the motors.
pub(super) const LATCHED: &str = "a fault is latched";
/// While the emergency input is open, the board is in its fault, and no motor moves.
pub(super) const EMERGENCY: &str = "an open emergency input holds the board";
/// A fault is reported once, at its start.
pub(super) const REPORTED: &str = "a fault is reported once";

/// Checker of the invariants of faults.
#[derive(Debug, Clone, Default)]
pub(super) struct Faults {
    /// Whether the emergency input is open.
    open: bool,
}

impl Faults {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        let Delivery { before, after, replies, at, .. } = delivery;
        check_report(before, after, replies, outcome);
        let Some(fault) = before.fault() else { return };
        if after.fault() == Some(fault) {
            return;
        }
        let clear = delivery.message.is_ok_and(|message| message.command == Command::ClearFault);
        let allowed = clear && after.fault().is_none();
        outcome.check(allowed, LATCHED, || {
            format!("{before:?} to {after:?} by {:?}", delivery.message)
        });
        outcome.check(!self.open, EMERGENCY, || {
            format!("{fault:?} was cleared by a message of {at} µs")
        });
    }

    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let Ticked { before, after, replies, .. } = ticked;
        check_report(before, after, replies, outcome);
        let latched = before.fault().is_none() || after.fault() == before.fault();
        outcome.check(latched, LATCHED, || format!("{before:?} to {after:?} by itself"));
        if ticked.emergency {
            let still = before.positions == after.positions && !ticked.pulses();
            let off = ticked.requests.is_none_or(|requests| !requests.drivers_enabled);
            let held = after.fault() == Some(Fault::EmergencyStop) && still && off;
            outcome.check(held, EMERGENCY, || format!("{ticked:?}"));
        }
    }

    pub(super) fn cut(&mut self, cut: &Cut<'_>, outcome: &mut Outcome) {
        self.open = true;
        let Cut { before, after, replies, .. } = cut;
        check_report(before, after, replies, outcome);
        let stopped = after.fault() == Some(Fault::EmergencyStop);
        outcome.check(stopped, EMERGENCY, || format!("{after:?}"));
    }

    pub(super) fn closed(&mut self) {
        self.open = false;
    }
}

fn check_report(before: &Snapshot, after: &Snapshot, replies: &[FromBoard], outcome: &mut Outcome) {
    let begun = after.fault().filter(|fault| before.fault() != Some(*fault));
    let mut reports = replies.iter().filter_map(|reply| match reply {
        FromBoard::Fault(report) => Some(report.fault),
        _ => None,
    });
    let holds = reports.next() == begun && reports.next().is_none();
    outcome.check(holds, REPORTED, || format!("{before:?} to {after:?} with {replies:?}"));
}
