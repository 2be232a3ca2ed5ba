//! The positions that a run has sent to the board.

use std::collections::VecDeque;

use plumb_protocol::message::Telemetry;

/// Number of positions that are kept: 2 s at 30 Hz.
const POSITIONS: usize = 60;

/// A position that was sent to the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SentPosition {
    /// Number by which telemetry names it.
    pub(super) sequence: u16,
    /// When it was sent, seconds on the source's clock.
    pub(super) time: f64,
    /// Whether the picture showed the ball.
    pub(super) has_ball: bool,
}

/// The positions that were sent last, the newest one at the end.
#[derive(Debug, Default)]
pub(super) struct SentPositions(VecDeque<SentPosition>);

impl SentPositions {
    /// Notes a position that was sent.
    pub(super) fn note(&mut self, position: SentPosition) {
        if self.0.len() == POSITIONS {
            self.0.pop_front();
        }
        self.0.push_back(position);
    }

    /// Returns the position that was sent last; `None` where there is none.
    pub(super) fn newest(&self) -> Option<SentPosition> {
        self.0.back().copied()
    }

    /// Returns the position that `telemetry` names; `None` where that is too long ago.
    pub(super) fn named_by(&self, telemetry: &Telemetry) -> Option<SentPosition> {
        let is_named = |it: &&SentPosition| telemetry.sequence == Some(it.sequence);
        self.0.iter().rev().find(is_named).copied()
    }
}
