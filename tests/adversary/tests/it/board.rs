//! The board with adversarial messages, for some seconds: no invariant is broken, and every fault,
//! refusal and command is exercised.

use plumb_adversary::campaign::{self, Outcome};

/// Runs, and ticks of each: thirty million in all.
const SEEDS: u64 = 1500;
const TICKS: u64 = 20_000;

/// Minimum count of everything.
const LEAST: u64 = 20;

/// Every fault except `Watchdog`, which exists only from the start, and `Driver`, which only a chip
/// reports.
const FAULTS: [&str; 10] = [
    "HostSilent",
    "PositionLost",
    "BallOutside",
    "TargetOutside",
    "Travel",
    "ErrorGrowing",
    "EmergencyStop",
    "LawLate",
    "NotFollowing",
    "NoProgress",
];

/// Every refusal that a message can cause.
const REFUSALS: [&str; 37] = [
    "OutsideTravel",
    "Config(MaxAge)",
    "NotGreeted",
    "Malformed",
    "Unconfigured",
    "Busy",
    "Faulted",
    "TargetOutside",
    "PositionStale",
    "PositionOutOfOrder",
    "BallOutside",
    "NoPosition",
    "NoSuchMotor",
    "JogRate",
    "JogTravel",
    "JogDistance",
    "Unsupported",
    "NotStored",
    "Config(Signs)",
    "Config(Bounds)",
    "Config(Gain)",
    "Config(MaxRate)",
    "Config(MaxAcceleration)",
    "Config(Travel)",
    "Config(Microsteps)",
    "Config(Workspace)",
    "Config(Reached)",
    "Config(Deadlines)",
    "Config(Growth)",
    "Config(Drivers)",
    "Config(Jog)",
    "Config(Following)",
    "Config(Progress)",
    "Config(Mean)",
    "Config(Delay)",
    "Config(Law)",
    "Config(Motors)",
];

/// Every command.
const COMMANDS: [&str; 12] = [
    "Hello",
    "Stop",
    "Bootloader",
    "Configure",
    "Position",
    "Target",
    "Jog",
    "Hold",
    "ClearFault",
    "Status",
    "Store",
    "Home",
];

/// Other counts.
const EVENTS: [&str; 13] = [
    "ticks seeking",
    "ticks holding",
    "ticks jogging",
    "ticks seeking in a plane",
    "ticks holding in a plane",
    "ticks with a twin",
    "emergencies",
    "restarts into the bootloader",
    "stored",
    "store failed",
    "law requests",
    "law requests lost",
    "repeated requests",
];

fn names() -> Vec<String> {
    let faults = FAULTS.iter().map(|name| format!("fault {name}"));
    let refusals = REFUSALS.iter().map(|name| format!("refused {name}"));
    let commands = COMMANDS.iter().map(|name| format!("{name} accepted"));
    let events = EVENTS.iter().map(|name| (*name).to_owned());
    faults.chain(refusals).chain(commands).chain(events).collect()
}

fn assert_exercised(outcome: &Outcome) {
    let tally = &outcome.tally;
    let missing: Vec<_> = names().into_iter().filter(|name| tally.of(name) < LEAST).collect();
    assert!(missing.is_empty(), "hardly or never exercised: {missing:?} of {tally}");
    assert!(tally.of("ticks moving") * 10 > tally.of("ticks"), "motors hardly turn: {tally}");
}

#[test]
fn no_message_breaks_an_invariant_of_the_board() {
    let outcome = campaign::run(1..1 + SEEDS, 2, |seed, outcome| {
        plumb_adversary::board::run(seed, TICKS, outcome);
    });
    outcome.assert_unbroken();
    assert_exercised(&outcome);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let run = || {
        campaign::run(1..9, 2, |seed, outcome| plumb_adversary::board::run(seed, 5_000, outcome))
    };
    assert_eq!(run(), run());
}
