//! The control laws with extreme measurements.

use plumb_adversary::campaign::Outcome;
use plumb_adversary::random::Random;
use plumb_adversary::{generate, laws};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "laws",
    input: "a configuration and measurements of a law",
    run,
    max_length: 4000,
    smoke: 200,
    words: &[],
};

/// Extreme measurements at most.
const MEASUREMENTS: u64 = 200;

/// Updates a law with the measurements in the input.
pub fn run(input: &[u8]) {
    let mut random = Random::of_input(input);
    let mut outcome = Outcome::of(0);
    let estimates = random.percent(50);
    let config = generate::accepted(&mut random, [0; 3]).config;
    if estimates {
        laws::run_deferred(&mut random, &config, MEASUREMENTS, &mut outcome);
    } else {
        laws::run_inline(&mut random, &config, MEASUREMENTS, &mut outcome);
    }
    outcome.assert_unbroken();
}
