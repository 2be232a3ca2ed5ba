//! The board under adversarial messages.
//!
//! ```text
//! adversary -> session -> board (and its twin) -> events -> invariants
//! ```
//!
//! The [`Adversary`](adversary::Adversary) chooses what happens next. The session carries it out on
//! a board, parses what went in with the reference decoder, and shows each event to the
//! [`Invariants`](invariants::Invariants). They know the board only by its public interface.

pub mod adversary;
mod count;
pub mod event;
pub mod invariants;
mod session;
mod thinking;

use crate::campaign::Outcome;

/// Runs one seed for `ticks` ticks.
pub fn run(seed: u64, ticks: u64, outcome: &mut Outcome) {
    session::Session::new(seed, outcome).run(ticks);
}
