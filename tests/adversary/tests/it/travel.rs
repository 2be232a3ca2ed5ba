//! Stops at the end of the travel, for some seconds.

use plumb_adversary::{campaign, travel};

#[test]
fn no_motor_passes_its_travel() {
    // 50 000 approaches.
    let outcome = campaign::run(1..101, 2, |seed, outcome| travel::run(seed, 500, outcome));
    outcome.assert_unbroken();
    let exercised = [
        "aimed once",
        "aimed at 30 Hz",
        "aimed at every tick",
        "aimed elsewhere at every tick",
        "aimed anywhere at any time",
        "there and back",
        "stops through a mean",
    ];
    outcome.assert_exercised(&exercised, 1000);
}
