//! Leaving for the bootloader.

use plumb_protocol::message::Command;

use super::super::event::{Delivery, Ticked};
use super::motion::begins_motion;
use crate::campaign::Outcome;

/// After Bootloader nothing begins any more.
pub(super) const LAST: &str = "nothing begins after Bootloader";
/// The chip is asked to restart at standstill only, and after a Bootloader.
pub(super) const AT_REST: &str = "the bootloader starts at rest";

/// Checker of [`LAST`] and [`AT_REST`].
#[derive(Debug, Clone, Default)]
pub(super) struct Bootloader {
    asked: bool,
    /// Whether the chip was asked to restart.
    told: bool,
}

impl Bootloader {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, outcome: &mut Outcome) {
        let sought = !delivery.before.seeking() && delivery.after.seeking();
        let began = self.asked && (sought || begins(delivery));
        outcome.check(!began, LAST, || format!("{:?} was accepted", delivery.message));
        self.asked |= delivery.message.is_ok_and(|message| message.command == Command::Bootloader);
    }

    pub(super) fn ticked(&mut self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let restarts = ticked.told.is_some_and(|told| told.bootloader);
        outcome.check(self.asked || !restarts, AT_REST, || "nobody asked for it".into());
        self.told |= restarts;
        let rest = ticked.before.positions == ticked.after.positions && !ticked.pulses();
        outcome.check(!self.told || rest, AT_REST, || format!("{ticked:?}"));
    }
}

/// Whether a new request that takes time was accepted: to move, to configure, to store.
fn begins(delivery: &Delivery<'_>) -> bool {
    let begins = |command: &Command| {
        begins_motion(command) || matches!(command, Command::Configure(_) | Command::Store)
    };
    !delivery.repeated && delivery.accepted().is_some_and(|message| begins(&message.command))
}
