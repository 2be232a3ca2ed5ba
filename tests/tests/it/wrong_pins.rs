//! Wrong pin maps: the check of the rig file and the board refuse the same ones with the same
//! keys, and nothing comes into force.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeSet;
use std::path::Path;

use plumb_config::toml_file::parse_toml;
use plumb_core::{BuildLimits, Tick};
use plumb_emulator::{EMULATED, EmulatedBoard, Harness, LawDelay};
use plumb_protocol::boards::{ALL, Board, Chip, PIN_COUNT};
use plumb_protocol::message::{Answer, Command, FromBoard, Hello, Refusal, State};
use plumb_protocol::units::Micros;
use plumb_protocol::wiring::{EnablePins, Line, Pins, Wiring, WiringError};
use plumb_runtime::fuzzing::{check_rig_text, unchecked_wiring};
use plumb_runtime::rig::Rig;
use plumb_runtime::rig::check::Severity;
use plumb_tests::is_long;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Wrong pin maps. 500 have each of the seven keys, and find a host that misses a pin of the LED or
/// a doubled pin of the UART.
const MAPS: usize = 500;
const MANY_MAPS: usize = 10_000;

/// Beginning of the rig files: the paper's, without its driver.
const PAPER: &str = include_str!("../../../host/rigs/paper.toml");

/// Pins of a rig file.
struct Map {
    board: &'static Board,
    pins: Pins,
    driver: &'static str,
    /// Pins of the drivers' UART in place of the usual ones.
    uart: Option<[u8; 2]>,
}

impl Map {
    /// Returns a map with one to four changes of a board's pins. It may be a right one.
    fn random(random: &mut ChaCha8Rng) -> Self {
        let board = ALL[random.random_range(0..ALL.len())];
        let mut pins = board.pins;
        if random.random_bool(0.3) {
            pins.enable =
                EnablePins::PerMotor([0; 3].map(|_| random.random_range(0..PIN_COUNT)).into());
        }
        for _ in 0..random.random_range(1..=4) {
            let pin = match random.random_range(0..4) {
                0 => random.random_range(PIN_COUNT..=u8::MAX),
                1 if !board.taken.is_empty() => {
                    board.taken[random.random_range(0..board.taken.len())].number
                }
                _ => random.random_range(0..PIN_COUNT),
            };
            *any_line(&mut pins, random) = pin;
        }
        let driver = match random.random_range(0..8) {
            2 => "{ tmc2209-uart = { run_current = 0.8 } }",
            0 => "{ coils = { duty = 0.5 } }",
            1 => "{ motor-hats = { duty = 0.5 } }",
            _ => "\"dm542\"",
        };
        let uart = random.random_bool(0.5).then(|| [0; 2].map(|_| random.random_range(0..40)));
        Self { board, pins, driver, uart }
    }

    /// Returns the text of a rig file with these pins.
    fn text(&self) -> String {
        let Pins { motors, enable, emergency, led, .. } = self.pins;
        let steps = motors.map(|motor| motor.step.number);
        let directions = motors.map(|motor| motor.direction.number);
        let enable = match enable {
            EnablePins::Shared(pin) => pin.to_string(),
            EnablePins::PerMotor(pins) => format!("{pins:?}"),
        };
        let led = led.map_or(String::new(), |led| format!("pins.led = {}\n", led.number));
        let uart = self.uart.map_or(String::new(), |uart| format!("pins.uart = {uart:?}\n"));
        let board = format!(
            "[board]\nkind = {:?}\npins.step = {steps:?}\npins.direction = {directions:?}\n\
             pins.enable = {enable}\npins.emergency = {}\n{led}{uart}",
            self.board.name, emergency.number
        );
        let text = PAPER.replacen("[board]\n", &board, 1);
        let text = text.replacen("driver = \"a4988\"", &format!("driver = {}", self.driver), 1);
        // What the slowest drivers follow.
        text.replacen("max_rate = 400.0", "max_rate = 300.0", 1)
    }
}

/// Returns the number of a random line's pin.
fn any_line<'a>(pins: &'a mut Pins, random: &mut ChaCha8Rng) -> &'a mut u8 {
    let motor = random.random_range(0..3);
    match random.random_range(0..5) {
        0 => &mut pins.motors[motor].step.number,
        1 => &mut pins.motors[motor].direction.number,
        2 => match &mut pins.enable {
            EnablePins::Shared(pin) => pin,
            EnablePins::PerMotor(pins) => &mut pins[motor],
        },
        3 => &mut pins.emergency.number,
        _ => match &mut pins.led {
            Some(led) => &mut led.number,
            None => &mut pins.emergency.number,
        },
    }
}

/// Returns the key of a refusal.
fn key(error: WiringError) -> &'static str {
    match error {
        WiringError::Board => "board.kind",
        WiringError::Motors => "motors.count",
        WiringError::Pen => "board.pins",
        WiringError::Drivers => "motors.driver",
        WiringError::Pin(Line::Step(_), _) => "board.pins.step",
        WiringError::Pin(Line::Direction(_), _) => "board.pins.direction",
        WiringError::Pin(Line::Enable(_), _) => "board.pins.enable",
        WiringError::Pin(Line::Emergency, _) => "board.pins.emergency",
        WiringError::Pin(Line::Led, _) => "board.pins.led",
        WiringError::Pin(Line::UartTx | Line::UartRx, _) => "board.pins.uart",
        WiringError::Addresses => "motors.driver.tmc2209-uart.addresses",
        WiringError::Pulse => "motors.timing.high",
        WiringError::InvertedEmergency => "board.inverted.emergency",
    }
}

/// Sends a wiring and a configuration to a board of this chip, and checks that it refuses both and
/// switches nothing on.
fn assert_refused(chip: Chip, wiring: Wiring, rig: &Rig, first: WiringError) {
    let build = BuildLimits { chip: Some(chip), ..EMULATED };
    let mut harness = Harness::new(build, LawDelay::SameTick);
    let commands = [
        Command::Hello(Hello::OURS),
        Command::Wire(wiring),
        Command::Configure(rig.config().expect("a configuration")),
    ];
    for command in commands {
        harness.send(Micros(0), command);
    }
    let mut refusals = harness.take_messages().into_iter().filter_map(|message| match message {
        Ok(FromBoard::Answer(Answer { refusal, .. })) => Some(refusal),
        _ => None,
    });
    assert_eq!(refusals.next(), Some(Some(Refusal::Wiring(first))));
    assert_eq!(refusals.next(), Some(Some(Refusal::NotWired)));
    let tick = harness.tick(Micros(0)).expect("requests");
    assert_eq!(tick, Tick::default(), "nothing is switched on");
    let board = &harness.board;
    assert_eq!((board.generation(), board.wiring(), board.state()), (0, None, State::Unconfigured));
}

#[test]
fn wrong_pin_maps_are_refused_with_their_keys_by_host_and_board() {
    let maps = if is_long() { MANY_MAPS } else { MAPS };
    let mut random = ChaCha8Rng::seed_from_u64(57);
    let (mut wrong, mut right) = (0, 0);
    let mut keys = BTreeSet::new();
    while wrong < maps {
        let map = Map::random(&mut random);
        let text = map.text();
        let rig = parse_toml::<Rig>(Path::new("rig.toml"), &text).expect("a rig file");
        let wiring = unchecked_wiring(&rig).expect("a wiring");
        let mut errors = Vec::new();
        wiring.each_error(Some(map.board.chip), |error| errors.push(error));
        let expected: BTreeSet<&str> = errors.iter().map(|error| key(*error)).collect();
        let found = check_rig_text(&text, &EmulatedBoard::refusals);
        let found: BTreeSet<&str> = found
            .iter()
            .filter(|finding| finding.severity == Severity::Error)
            .map(|finding| finding.values[0].0.as_str())
            .collect();
        assert_eq!(found, expected, "{errors:?} in\n{text}");
        let refused = rig.wiring().err().map(|refused| refused.key);
        assert_eq!(refused, errors.first().map(|first| key(*first)), "before a run");
        let Some(first) = errors.first() else {
            right += 1;
            continue;
        };
        assert_refused(map.board.chip, wiring, &rig, *first);
        keys.extend(expected.iter().map(|key| (*key).to_owned()));
        wrong += 1;
    }
    println!("{wrong} wrong maps and {right} right ones");
    assert_eq!(keys.len(), 7, "{keys:?}");
}

#[test]
fn every_boards_own_pins_are_accepted_by_its_chip_alone() {
    for board in ALL {
        let wiring = Wiring { board: board.kind, pins: board.pins, ..Wiring::example() };
        assert_eq!(wiring.check(Some(board.chip)), Ok(()), "{}", board.name);
        let other = if board.chip == Chip::Rp2040 { Chip::Rp2350 } else { Chip::Rp2040 };
        assert_eq!(wiring.check(Some(other)), Err(WiringError::Board), "{}", board.name);
    }
}
