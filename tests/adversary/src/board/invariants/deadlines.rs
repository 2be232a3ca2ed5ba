//! Deadlines of the host and of positions.

use plumb_protocol::message::{Command, State};

use super::super::event::{Delivery, TICK, Ticked};
use super::limits::Limits;
use crate::campaign::Outcome;

/// If the host is silent beyond its deadline, the board neither seeks nor holds, and all motors
/// rest after the longest stop.
pub(super) const HOST: &str = "a silent host stops the board";
/// Without a position within its deadline the board neither seeks nor holds. Along a path all
/// motors rest after the longest stop, and after 2 s more the board no longer follows.
pub(super) const POSITION: &str = "the absence of positions stops the board";

/// Tolerance of a deadline, ticks: the current one, and one for the time of arrival.
const SLACK: u64 = 2 * TICK;
/// Time that a board waits on a path without a position, µs.
const PATIENCE: u64 = 2_000_000;

/// Checker of [`HOST`].
#[derive(Debug, Clone, Default)]
pub(super) struct HostDeadline {
    /// Time of the last command, µs.
    last_rx: u64,
}

impl HostDeadline {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>) {
        if delivery.message.is_ok() {
            self.last_rx = self.last_rx.max(delivery.at);
        }
    }

    pub(super) fn ticked(&self, ticked: &Ticked<'_>, limits: &Limits, outcome: &mut Outcome) {
        let silence = ticked.now.saturating_sub(self.last_rx);
        let limit = u64::from(limits.deadlines.host.0) * 1000 + SLACK;
        if silence <= limit {
            return;
        }
        let stopping = !ticked.after.seeking();
        let rest = !ticked.pulses() || silence <= limit + limits.longest_stop() * TICK;
        outcome.check(stopping && rest, HOST, || {
            format!(
                "{:?} {silence} µs after the last message, {:?}",
                ticked.after, limits.deadlines
            )
        });
    }
}

/// Checker of [`POSITION`].
#[derive(Debug, Clone, Default)]
pub(super) struct PositionDeadline {
    /// Time of the newest accepted position, µs.
    captured: u64,
    /// Start of seeking, µs. A new target does not change it.
    since: u64,
}

impl PositionDeadline {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>) {
        if delivery.configured() {
            self.captured = 0;
        }
        if !delivery.before.seeking() && delivery.after.seeking() {
            self.since = delivery.at;
        }
        if let Some(message) = delivery.accepted()
            && let Command::Position(position) = message.command
            && position.ball.is_some()
        {
            let captured = delivery.at.saturating_sub(position.age_us.into());
            self.captured = self.captured.max(captured);
        }
    }

    pub(super) fn ticked(&self, ticked: &Ticked<'_>, limits: &Limits, outcome: &mut Outcome) {
        if !ticked.after.seeking() {
            return;
        }
        let unseen = ticked.now.saturating_sub(self.captured.max(self.since));
        let limit = u64::from(limits.deadlines.position.0) * 1000 + SLACK;
        let follows = ticked.after.state == State::Following;
        let waits = follows && unseen <= limit + PATIENCE;
        let rests = !ticked.pulses() || unseen <= limit + limits.longest_stop() * TICK;
        outcome.check(unseen <= limit || (waits && rests), POSITION, || {
            format!(
                "{:?} {unseen} µs after the last position, {:?}",
                ticked.after.state, limits.deadlines
            )
        });
    }
}
