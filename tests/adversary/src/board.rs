//! The board with adversarial messages.
//!
//! ```text
//! adversary -> session -> board (and its twin) -> events -> invariants
//! ```
//!
//! The [`Adversary`](adversary::Adversary) chooses the next action. The session executes it on a
//! board, decodes the input with the reference decoder, and passes each event to the
//! [`Invariants`](invariants::Invariants). They use the board's public interface only.

pub mod adversary;
mod chip;
mod count;
mod delayed_law;
pub mod event;
pub mod invariants;
pub mod requests;
mod session;

use crate::campaign::Outcome;
use crate::random::Random;

/// Runs one seed for `ticks` ticks.
pub fn run(seed: u64, ticks: u64, outcome: &mut Outcome) {
    run_with(Random::new(seed), ticks, outcome);
}

/// Runs a board with the decisions of `random` for `ticks` ticks, or until its input is used up.
pub fn run_with(random: Random, ticks: u64, outcome: &mut Outcome) {
    session::Session::new(random, outcome).run(ticks);
}
