//! Invariants of the board for any input.
//!
//! Each invariant has a name, for reports, and a checker. Checkers get the events of
//! [`event`](super::event) and store their own history.

mod answers;
mod bootloader;
mod deadlines;
mod faults;
mod limits;
mod motion;
mod reference;
mod standstill;
mod storage;
#[cfg(test)]
mod tests;

use plumb_core::Board;
use plumb_protocol::Config;

use super::event::{Cut, Delivery, Ticked};
use crate::campaign::Outcome;
use answers::{Answers, Names, Telemetry};
use bootloader::Bootloader;
use deadlines::{HostDeadline, PositionDeadline};
use faults::Faults;
use limits::Limits;
use motion::Acceleration;
use reference::ReferenceSpeed;
use standstill::Standstill;
use storage::Storage;

/// Every frame that the board sends is intact.
pub const UNBROKEN: &str = "the board's frames are intact";
/// `report` does not change the plan of the tick.
pub const REPORT: &str = "report leaves the plan";
/// Two boards with the same input in different pieces have the same output, to the bit.
pub const TWIN: &str = "twins agree";
/// A new configuration resets the state of the law.
pub const FRESH_LAW: &str = "a configured law begins anew";

/// All checkers of one board, from its start.
#[derive(Debug, Clone)]
pub struct Invariants {
    limits: Option<Limits>,
    acceleration: Acceleration,
    reference: ReferenceSpeed,
    standstill: Standstill,
    faults: Faults,
    host_deadline: HostDeadline,
    position_deadline: PositionDeadline,
    answers: Answers,
    telemetry: Telemetry,
    names: Names,
    storage: Storage,
    bootloader: Bootloader,
}

impl Invariants {
    /// Returns the checkers of a board that has just started.
    pub fn new(board: &Board) -> Self {
        Self {
            limits: board.config().map(Limits::of),
            acceleration: Acceleration::default(),
            reference: ReferenceSpeed::default(),
            standstill: Standstill::at_start(),
            faults: Faults::default(),
            host_deadline: HostDeadline::default(),
            position_deadline: PositionDeadline::default(),
            answers: Answers::default(),
            telemetry: Telemetry::default(),
            names: Names::default(),
            storage: Storage::default(),
            bootloader: Bootloader::default(),
        }
    }

    /// Checks the effect of a frame; `config` is the configuration after it.
    pub fn delivered(
        &mut self,
        delivery: &Delivery<'_>,
        config: Option<&Config>,
        outcome: &mut Outcome,
    ) {
        if delivery.configured() {
            self.limits = config.map(Limits::of);
            self.acceleration = Acceleration::default();
        }
        motion::check_delivery(delivery, outcome);
        answers::check_entries(delivery.replies, self.limits.as_ref(), outcome);
        self.reference.delivered(delivery, self.limits.as_ref(), outcome);
        self.standstill.delivered(delivery, self.limits.as_ref());
        self.faults.delivered(delivery, outcome);
        self.host_deadline.delivered(delivery);
        self.position_deadline.delivered(delivery);
        self.answers.delivered(delivery, outcome);
        self.telemetry.delivered(delivery);
        self.names.delivered(delivery, outcome);
        self.storage.delivered(delivery, outcome);
        self.bootloader.delivered(delivery, outcome);
    }

    /// Checks a tick.
    pub fn ticked(&mut self, ticked: &Ticked<'_>, outcome: &mut Outcome) {
        let limits = self.limits.as_ref();
        motion::check_tick(ticked, limits, outcome);
        answers::check_entries(ticked.replies, limits, outcome);
        if let Some(limits) = limits {
            self.acceleration.ticked(ticked, limits, outcome);
            self.reference.ticked(ticked, limits, outcome);
            self.host_deadline.ticked(ticked, limits, outcome);
            self.position_deadline.ticked(ticked, limits, outcome);
        }
        self.faults.ticked(ticked, outcome);
        self.standstill.ticked(ticked, limits, outcome);
        self.answers.ticked(ticked, outcome);
        self.telemetry.ticked(ticked, outcome);
        self.names.hear(ticked.replies, outcome);
        self.storage.ticked(ticked, outcome);
        self.bootloader.ticked(ticked, outcome);
    }

    /// Checks an emergency stop.
    pub fn cut(&mut self, cut: &Cut<'_>, outcome: &mut Outcome) {
        self.faults.cut(cut, outcome);
        self.telemetry.hear(cut.replies);
        answers::check_entries(cut.replies, self.limits.as_ref(), outcome);
        self.names.hear(cut.replies, outcome);
        motion::check_cut(cut, self.limits.as_ref(), outcome);
        self.acceleration = Acceleration::default();
        self.standstill.cut();
    }

    /// Records that the emergency input is closed.
    pub fn closed(&mut self) {
        self.faults.closed();
    }

    /// Checks the messages after the configuration was written.
    pub fn stored(
        &mut self,
        replies: &[plumb_protocol::message::FromBoard],
        outcome: &mut Outcome,
    ) {
        self.storage.stored(replies, outcome);
    }

    /// Checks the messages after the chip has told its counts.
    pub fn diagnosed(
        &mut self,
        replies: &[plumb_protocol::message::FromBoard],
        outcome: &mut Outcome,
    ) {
        self.answers.diagnosed(replies, outcome);
    }

    /// Checks the messages after the chip has measured.
    pub fn measured(
        &mut self,
        replies: &[plumb_protocol::message::FromBoard],
        outcome: &mut Outcome,
    ) {
        self.answers.measured(replies, outcome);
    }

    /// Checks the end of a run.
    pub fn end(&self, outcome: &mut Outcome) {
        self.storage.end(outcome);
    }
}
