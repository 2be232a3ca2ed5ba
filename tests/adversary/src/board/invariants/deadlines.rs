//! Deadlines: of the host, and of positions.

use plumb_protocol::message::Command;

use super::super::event::{Delivery, TICK, Ticked};
use super::limits::Limits;
use crate::campaign::Outcome;

/// Without a message from the host for its deadline, the board is not seeking or holding any more,
/// and no motor turns for longer than the longest stop.
pub(super) const HOST: &str = "a silent host stops the board";
/// Without a picture that was taken within the position deadline the board does not seek or hold.
pub(super) const POSITION: &str = "a lost position stops the board";

/// Ticks that a deadline may be late: the one under way, and one for the time of arrival, which
/// may lie a tick off.
const SLACK: u64 = 2 * TICK;

/// Checker of [`HOST`].
#[derive(Debug, Clone, Default)]
pub(super) struct HostDeadline {
    /// When the last command came, µs.
    heard: u64,
}

impl HostDeadline {
    pub(super) fn delivered(&mut self, delivery: &Delivery<'_>) {
        if delivery.message.is_ok() {
            self.heard = self.heard.max(delivery.at);
        }
    }

    pub(super) fn ticked(&self, ticked: &Ticked<'_>, limits: &Limits, outcome: &mut Outcome) {
        let silence = ticked.now.saturating_sub(self.heard);
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
    /// When the newest accepted picture was taken, µs.
    captured: u64,
    /// When the board began to seek, µs. Another target does not begin anew.
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
        outcome.check(unseen <= limit, POSITION, || {
            format!(
                "{:?} {unseen} µs after the last picture, {:?}",
                ticked.after.state, limits.deadlines
            )
        });
    }
}
