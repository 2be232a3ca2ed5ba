//! The laws with extreme input, for some seconds.

use plumb_adversary::{campaign, laws};

#[test]
fn no_measurement_breaks_an_invariant_of_the_laws() {
    let outcome = campaign::run(1..201, 2, |seed, outcome| laws::run(seed, 500, outcome));
    outcome.assert_unbroken();
    outcome.assert_exercised(
        &[
            "law adaptive",
            "law taut",
            "law quick",
            "laws in a plane",
            "setpoints with motion",
            "recovered",
        ],
        50,
    );
}
