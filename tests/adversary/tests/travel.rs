//! Stops at the end of the travel, for some seconds.

use plumb_adversary::{campaign, travel};

#[test]
fn no_motor_passes_its_travel() {
    // 50 000 approaches.
    let outcome = campaign::run(1..101, 2, |seed, outcome| travel::run(seed, 500, outcome));
    let broken: Vec<String> = outcome.summary().iter().map(ToString::to_string).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    let aims =
        ["once", "at 30 Hz", "at every tick", "elsewhere at every tick", "anywhere at any time"];
    for name in aims.map(|aim| format!("aimed {aim}")) {
        assert!(outcome.tally.of(&name) > 1000, "{name} is too rare: {}", outcome.tally);
    }
    assert!(outcome.tally.of("there and back") > 1000, "{}", outcome.tally);
    assert!(outcome.tally.of("stops through a mean") > 1000, "{}", outcome.tally);
}
