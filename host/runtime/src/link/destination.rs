//! What the board was asked to drive to: a target, or a path in parts, each of which replaces the
//! one before. A lost part is not repeated.

use std::collections::VecDeque;

use plumb_protocol::message::Refusal;

use super::commands::GoalNumber;

/// Number of parts of a path that telemetry may name: those of 2 s at 30 Hz.
const PARTS: usize = 60;

/// Target or path that the board was asked for.
#[derive(Debug, Clone)]
pub(super) struct Destination {
    pub(super) goal: GoalNumber,
    kind: Kind,
    /// Ids of its commands that telemetry may name, the newest one last.
    ids: VecDeque<u16>,
    /// Number of the newest commands whose motions come to rest at one place.
    pub(super) same_rest: usize,
    pub(super) is_accepted: bool,
    pub(super) refusal: Option<Refusal>,
}

/// Kind of a destination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// One place.
    Target,
    /// A path, or a target that moves.
    Path,
}

impl Destination {
    pub(super) fn new(goal: GoalNumber, kind: Kind) -> Self {
        let (ids, same_rest) = (VecDeque::new(), 0);
        Self { goal, kind, ids, same_rest, is_accepted: false, refusal: None }
    }

    pub(super) fn push(&mut self, id: u16) {
        if self.ids.len() == PARTS {
            self.ids.pop_front();
        }
        self.ids.push_back(id);
        self.same_rest += 1;
    }

    /// Returns whether a command with this id belongs to the destination.
    pub(super) fn has(&self, id: u16) -> bool {
        self.ids.contains(&id)
    }

    /// Returns whether a command with this id is a part of the path whose motion comes to rest
    /// where that of the newest one does.
    pub(super) fn has_same_rest(&self, id: u16) -> bool {
        self.ids.iter().rev().take(self.same_rest).any(|known| *known == id)
    }

    pub(super) fn is_path(&self) -> bool {
        self.kind == Kind::Path
    }
}
