//! Standstill at the start, after a stop, after a fault, and during a Store.

use plumb_protocol::message::Command;

use super::super::event::{Delivery, TICK, Ticked};
use super::limits::Limits;
use super::motion::{begins_motion, ends_motion};
use crate::campaign::Outcome;

/// Motors move only after an accepted Target, Hold or Jog. After Stop, Bootloader, a Hello that
/// does not match, or a fault, they rest after their ramp.
pub(super) const STANDSTILL: &str = "motors rest unless commanded to move";

/// Checker of [`STANDSTILL`].
#[derive(Debug, Clone)]
pub(super) struct Standstill {
    /// Time from which the motors must rest, µs; `None` if they may move.
    from: Option<u64>,
    /// Start of the next tick, µs.
    now: u64,
}

impl Standstill {
    /// Returns the checker for a board that has not moved.
    pub(super) fn at_start() -> Self {
        Self { from: Some(0), now: 0 }
    }

    /// Requires rest in `ticks` ticks from now, or earlier if required before.
    fn require(&mut self, ticks: u64) {
        let from = self.now + ticks * TICK;
        self.from = Some(self.from.map_or(from, |earlier| earlier.min(from)));
    }

    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>, limits: Option<&Limits>) {
        let Delivery { before, after, .. } = delivery;
        let stop = limits.map_or(0, |limits| limits.stop_ticks(before.rates));
        if let Some(message) = delivery.accepted() {
            let command = &message.command;
            if begins_motion(command) && after.fault().is_none() {
                self.from = None;
            }
            if ends_motion(command) {
                self.require(stop);
            }
            let answered = delivery.answers(message.id).next().is_some();
            if matches!(command, Command::Store) && !answered {
                self.require(0);
            }
        }
        if before.fault().is_none() && after.fault().is_some() {
            self.require(stop);
        }
        if delivery.configured() || (before.fault().is_some() && after.fault().is_none()) {
            // Both happen at standstill.
            self.require(0);
        }
    }

    pub(super) fn cut(&mut self) {
        self.require(0);
    }

    pub(super) fn ticked(
        &mut self,
        ticked: &Ticked<'_>,
        limits: Option<&Limits>,
        outcome: &mut Outcome,
    ) {
        let Ticked { now, before, after, .. } = ticked;
        let rest = before.positions == after.positions && after.rates == [0; 3] && !ticked.pulses();
        let late = !rest && self.from.is_some_and(|from| *now >= from);
        outcome.check(!late, STANDSTILL, || {
            format!(
                "{:?} at {:?} Q8 steps/s, rest required from {:?} µs",
                after.state, after.rates, self.from
            )
        });
        self.now = now + TICK;
        if before.fault().is_none() && after.fault().is_some() {
            self.require(limits.map_or(0, |limits| limits.stop_ticks(before.rates)));
        }
    }
}
