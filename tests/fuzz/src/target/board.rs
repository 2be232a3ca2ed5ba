//! A board over time: configurations, commands, damaged frames, emergencies, restarts.

use plumb_adversary::board;
use plumb_adversary::campaign::Outcome;
use plumb_adversary::random::Random;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "board",
    input: "decisions of an adversary of the board, who checks every invariant in every tick",
    run,
    max_length: 2000,
    smoke: 200,
    words: &[],
};

/// Ticks of a run at most: 0.4 s of the board.
const TICKS: u64 = 2_000;

/// Runs a board with the decisions in the input.
pub fn run(input: &[u8]) {
    let mut outcome = Outcome::of(0);
    board::run_with(Random::of_input(input), TICKS, &mut outcome);
    outcome.assert_unbroken();
}
