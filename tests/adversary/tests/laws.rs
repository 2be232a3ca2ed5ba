//! The laws with extreme input, for some seconds.

use plumb_adversary::{campaign, laws};

#[test]
fn no_picture_breaks_an_invariant_of_the_laws() {
    let outcome = campaign::run(1..201, 2, |seed, outcome| laws::run(seed, 500, outcome));
    let broken: Vec<String> = outcome.summary().iter().map(ToString::to_string).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    for name in ["law adaptive", "law taut", "law quick", "demands of motion", "recovered"] {
        assert!(outcome.tally.of(name) > 50, "{name} is too rare: {}", outcome.tally);
    }
}
