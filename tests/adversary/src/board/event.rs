//! Events of a board, from its public interface.

use plumb_core::{Board, StepPlan, TICK_US, Tick};
use plumb_protocol::frame::FrameError;
use plumb_protocol::message::*;

/// Duration of a tick, µs.
pub const TICK: u64 = TICK_US as u64;

/// State of a board at one time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Snapshot {
    /// Motor positions, 1/16 steps since the start.
    pub positions: [i32; 3],
    /// Motor positions, 1/16 steps from the zero of travel.
    pub travel: [i32; 3],
    /// Motor rates, Q8 steps/s.
    pub rates: [i32; 3],
    /// The state.
    pub state: State,
    /// Number of configurations since the start.
    pub generation: u32,
}

impl Snapshot {
    /// Returns the board's current values.
    pub fn of(board: &Board) -> Self {
        Self {
            positions: board.positions(),
            travel: board.travel_positions(),
            rates: board.rates(),
            state: board.state(),
            generation: board.generation(),
        }
    }

    /// Returns whether the board seeks, holds or follows.
    pub fn seeking(&self) -> bool {
        matches!(self.state, State::Seeking | State::Holding | State::Following)
    }

    /// Returns the board's fault, if any.
    pub fn fault(&self) -> Option<Fault> {
        match self.state {
            State::Fault(fault) => Some(fault),
            _ => None,
        }
    }
}

/// Reception of the end of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Delivery<'a> {
    /// Time of reception, µs.
    pub at: u64,
    /// Content of the frame, from the reference decoder.
    pub message: Result<ToBoard, FrameError>,
    /// Whether the command is a repetition of the last executed request, with the same id.
    pub repeated: bool,
    /// Messages of the board.
    pub replies: &'a [FromBoard],
    /// State before the event.
    pub before: Snapshot,
    /// State after the event.
    pub after: Snapshot,
}

impl Delivery<'_> {
    /// Returns the refusal, or `None` for an acceptance, of each answer with this id.
    pub fn answers(&self, id: u16) -> impl Iterator<Item = Option<Refusal>> + '_ {
        self.replies.iter().filter_map(move |reply| match reply {
            FromBoard::Answer(answer) if answer.id == id => Some(answer.refusal),
            _ => None,
        })
    }

    /// Returns the number of answers to any command.
    pub fn answer_count(&self) -> usize {
        self.replies.iter().filter(|reply| matches!(reply, FromBoard::Answer(_))).count()
    }

    /// Returns the command and its id, if the board did not refuse it.
    pub fn accepted(&self) -> Option<ToBoard> {
        let message = self.message.ok()?;
        let refused = self.answers(message.id).any(|refusal| refusal.is_some());
        (!refused).then_some(message)
    }

    /// Returns whether the frame configured the board.
    pub fn configured(&self) -> bool {
        self.before.generation != self.after.generation
    }
}

/// Execution of a tick.
#[derive(Debug, Clone, Copy)]
pub struct Ticked<'a> {
    /// Start of the tick, µs.
    pub now: u64,
    /// State before the event.
    pub before: Snapshot,
    /// State after the event.
    pub after: Snapshot,
    /// Pulses of the tick.
    pub plan: StepPlan,
    /// Requests of the board to its chip, if they may have changed.
    pub requests: Option<Tick>,
    /// Messages of the board.
    pub replies: &'a [FromBoard],
    /// Whether the emergency input is open.
    pub emergency: bool,
}

impl Ticked<'_> {
    /// Returns whether a motor has a pulse.
    pub fn pulses(&self) -> bool {
        self.plan.motors.iter().any(|motor| motor.count > 0)
    }
}

/// Emergency stop: the input has cut the pulses, or is still open.
#[derive(Debug, Clone, Copy)]
pub struct Cut<'a> {
    /// Planned pulses that were not executed; + if the direction line is high.
    pub missing: [i32; 3],
    /// State before the event.
    pub before: Snapshot,
    /// State after the event.
    pub after: Snapshot,
    /// Messages of the board.
    pub replies: &'a [FromBoard],
}
