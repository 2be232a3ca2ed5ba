//! What happens to a board, as its public interface shows it.

use plumb_core::{Board, StepPlan, TICK_US, Tick};
use plumb_protocol::frame::FrameError;
use plumb_protocol::message::*;

/// A tick, µs.
pub const TICK: u64 = TICK_US as u64;

/// A board at a moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Snapshot {
    /// 1/16 steps.
    pub positions: [i32; 3],
    /// Q8 steps/s.
    pub rates: [i32; 3],
    /// The state.
    pub state: State,
    /// How often the board was configured.
    pub generation: u32,
}

impl Snapshot {
    /// Returns the board's present values.
    pub fn of(board: &Board) -> Self {
        Self {
            positions: board.positions(),
            rates: board.rates(),
            state: board.state(),
            generation: board.generation(),
        }
    }

    /// Whether the board drives the ball or keeps it at its target.
    pub fn seeking(&self) -> bool {
        matches!(self.state, State::Seeking | State::Holding)
    }

    /// The fault that the board is in.
    pub fn fault(&self) -> Option<Fault> {
        match self.state {
            State::Fault(fault) => Some(fault),
            _ => None,
        }
    }
}

/// The end of a frame has arrived.
#[derive(Debug, Clone, Copy)]
pub struct Delivery<'a> {
    /// The time that the board was given with it, µs.
    pub at: u64,
    /// What the frame was, by the reference decoder.
    pub message: Result<ToBoard, FrameError>,
    /// Whether the command, with its id, is the last one that was carried out: a repeated request.
    pub repeated: bool,
    /// What the board said.
    pub replies: &'a [FromBoard],
    /// The board before it.
    pub before: Snapshot,
    /// The board after it.
    pub after: Snapshot,
}

impl Delivery<'_> {
    /// Returns the refusals and acceptances with the command's id.
    pub fn answers(&self, id: u16) -> impl Iterator<Item = Option<Refusal>> + '_ {
        self.replies.iter().filter_map(move |reply| match reply {
            FromBoard::Answer(answer) if answer.id == id => Some(answer.refusal),
            _ => None,
        })
    }

    /// Returns the number of answers to whatever command.
    pub fn answer_count(&self) -> usize {
        self.replies.iter().filter(|reply| matches!(reply, FromBoard::Answer(_))).count()
    }

    /// Returns the command and its id where the frame was one that the board did not refuse.
    pub fn accepted(&self) -> Option<ToBoard> {
        let message = self.message.ok()?;
        let refused = self.answers(message.id).any(|refusal| refusal.is_some());
        (!refused).then_some(message)
    }

    /// Whether the board was configured by it.
    pub fn configured(&self) -> bool {
        self.before.generation != self.after.generation
    }
}

/// A tick was planned and reported.
#[derive(Debug, Clone, Copy)]
pub struct Ticked<'a> {
    /// When it began, µs.
    pub now: u64,
    /// The board before it.
    pub before: Snapshot,
    /// The board after it.
    pub after: Snapshot,
    /// Its pulses.
    pub plan: StepPlan,
    /// What the board asked its chip for, if that may have changed.
    pub told: Option<Tick>,
    /// What the board said.
    pub replies: &'a [FromBoard],
    /// Whether the emergency input is open.
    pub emergency: bool,
}

impl Ticked<'_> {
    /// Whether a motor gets a pulse.
    pub fn pulses(&self) -> bool {
        self.plan.motors.iter().any(|motor| motor.count > 0)
    }
}

/// The emergency input has cut the pulses off, or is still open.
#[derive(Debug, Clone, Copy)]
pub struct Cut<'a> {
    /// The pulses that were planned and not given, + where the direction line is high.
    pub missing: [i32; 3],
    /// The board before it.
    pub before: Snapshot,
    /// The board after it.
    pub after: Snapshot,
    /// What the board said.
    pub replies: &'a [FromBoard],
}
