//! Restart into the bootloader.

use plumb_protocol::message::Command;

use super::super::event::{Delivery, Ticked};
use super::motion::begins_motion;
use crate::campaign::Outcome;

/// After Bootloader no motion, configuration or Store starts.
pub(super) const LAST: &str = "nothing begins after Bootloader";
/// The board requests a restart only at standstill, after a Bootloader.
pub(super) const AT_REST: &str = "the bootloader starts at rest";

/// Checker of [`LAST`] and [`AT_REST`].
#[derive(Debug, Clone, Default)]
pub(super) struct Bootloader {
    asked: bool,
    /// Whether the board has requested a restart.
    requests: bool,
}

impl Bootloader {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        let sought = !delivery.before.seeking() && delivery.after.seeking();
        let began = self.asked && (sought || begins(delivery));
        outcome.check(!began, LAST, || format!("{:?} was accepted", delivery.message));
        self.asked |= delivery.message.is_ok_and(|message| message.command == Command::Bootloader);
    }

    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let restarts = ticked.requests.is_some_and(|requests| requests.bootloader);
        outcome.check(self.asked || !restarts, AT_REST, || "nobody asked for it".into());
        self.requests |= restarts;
        let rest = ticked.before.positions == ticked.after.positions && !ticked.pulses();
        outcome.check(!self.requests || rest, AT_REST, || format!("{ticked:?}"));
    }
}

/// Returns whether a new request for motion, configuration or Store was accepted.
fn begins(delivery: &Delivery<'_>) -> bool {
    let begins = |command: &Command| {
        begins_motion(command) || matches!(command, Command::Configure(_) | Command::Store)
    };
    !delivery.repeated && delivery.accepted().is_some_and(|message| begins(&message.command))
}
