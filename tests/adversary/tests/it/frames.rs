//! The frame decoder against a simple reference, for a second.

use plumb_adversary::{campaign, frames};

#[test]
fn the_decoder_agrees_with_its_reference() {
    let outcome = campaign::run(1..17, 2, |seed, outcome| frames::run(seed, 2_000, outcome));
    outcome.assert_unbroken();
    let exercised =
        ["decoded", "torn", "wrong checksum", "overlong", "positions parsed from any bytes"];
    outcome.assert_exercised(&exercised, 100);
}
