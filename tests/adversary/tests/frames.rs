//! The frame decoder against a simple reference, for a second.

use plumb_adversary::{campaign, frames};

#[test]
fn the_decoder_agrees_with_its_reference() {
    let outcome = campaign::run(1..17, 2, |seed, outcome| frames::run(seed, 2_000, outcome));
    let broken: Vec<String> = outcome.summary().iter().map(ToString::to_string).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    let exercised =
        ["decoded", "torn", "wrong checksum", "overlong", "positions parsed from any bytes"];
    for name in exercised {
        assert!(outcome.tally.of(name) > 100, "{name} is too rare: {}", outcome.tally);
    }
}
