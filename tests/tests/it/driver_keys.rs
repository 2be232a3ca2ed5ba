//! TMC2209 on a UART in rig files: what is refused, with its key, and what reaches the board.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use plumb_config::toml_file::parse_toml;
use plumb_emulator::EmulatedBoard;
use plumb_protocol::boards::SKR_PICO;
use plumb_protocol::units::{Milliamperes, Milliohms};
use plumb_protocol::wiring::{Chopper, Drivers, Tmc2209};
use plumb_runtime::fuzzing::check_rig_text;
use plumb_runtime::rig::Rig;
use plumb_runtime::rig::check::Severity;

const PAPER: &str = include_str!("../../../host/rigs/paper.toml");

/// Returns the paper's rig file for an SKR Pico with these drivers and pins.
fn text(driver: &str, pins: &str) -> String {
    let board = format!("[board]\nkind = \"skr-pico\"\n{pins}\n");
    let text = PAPER.replacen("[board]\n", &board, 1);
    text.replacen("driver = \"a4988\"", &format!("driver = {driver}"), 1)
}

/// Returns the key of each finding of this severity about the board and its drivers.
fn keys(text: &str, severity: Severity) -> Vec<String> {
    let findings = check_rig_text(text, &EmulatedBoard::refusals);
    let found = findings.into_iter().filter(|finding| finding.severity == severity);
    let keys = found.map(|finding| finding.values[0].0.clone());
    keys.filter(|key| key.starts_with("board.") || key.starts_with("motors.")).collect()
}

#[test]
fn every_setting_reaches_the_board() {
    let driver = "{ tmc2209-uart = { run_current = 1.2, hold_current = 0.45, mode = \
                  \"spreadcycle\", sense_resistor = 0.15, addresses = [3, 1, 0] } }";
    let rig = parse_toml::<Rig>(Path::new("rig.toml"), &text(driver, "")).expect("a rig file");
    let expected = Tmc2209 {
        run: Milliamperes(1200),
        hold: Milliamperes(450),
        sense: Milliohms(150),
        chopper: Chopper::SpreadCycle,
        addresses: [3, 1, 0].into(),
        ..Tmc2209::of(&SKR_PICO)
    };
    assert_eq!(rig.wiring().expect("a wiring").drivers, Drivers::Tmc2209(expected));
    let least = text("{ tmc2209-uart = { run_current = 0.8 } }", "");
    let rig = parse_toml::<Rig>(Path::new("rig.toml"), &least).expect("a rig file");
    let usual = Drivers::Tmc2209(Tmc2209::of(&SKR_PICO));
    assert_eq!(rig.wiring().expect("a wiring").drivers, usual);
    assert_eq!(keys(&least, Severity::Error), [""; 0]);
    assert_eq!(keys(&least, Severity::Warning), [""; 0]);
}

#[test]
fn wrong_settings_are_refused_with_their_keys() {
    let cases = [
        ("run_current = 1.9", "", "motors.driver.tmc2209-uart.run_current"),
        ("run_current = 0.0", "", "motors.driver.tmc2209-uart.run_current"),
        ("hold_current = 0.8", "", "motors.driver.tmc2209-uart.run_current"),
        ("run_current = 0.8, hold_current = 0.9", "", "motors.driver.tmc2209-uart.hold_current"),
        ("run_current = 0.8, hold_current = 0.001", "", "motors.driver.tmc2209-uart.hold_current"),
        ("run_current = 0.8, sense_resistor = 1", "", "motors.driver.tmc2209-uart.run_current"),
        ("run_current = 0.8, mode = \"quiet\"", "", "motors.driver.tmc2209-uart.mode"),
        ("run_current = 0.8, addresses = [0, 4, 1]", "", "motors.driver.tmc2209-uart.addresses"),
        ("run_current = 0.8, addresses = [0, 1, 1]", "", "motors.driver.tmc2209-uart.addresses"),
        ("run_current = 0.8", "pins.uart = [4, 5]", "board.pins.uart"),
        ("run_current = 0.8", "pins.uart = [9, 8]", "board.pins.uart"),
    ];
    for (settings, pins, key) in cases {
        let text = text(&format!("{{ tmc2209-uart = {{ {settings} }} }}"), pins);
        let found = keys(&text, Severity::Error);
        assert!(found.first().is_some_and(|found| found == key), "{settings}, {pins}: {found:?}");
    }
}

/// Returns what the check says of these settings, without the key; all of it is about one key.
fn problem(settings: &str) -> String {
    let text = text(&format!("{{ tmc2209-uart = {{ {settings} }} }}"), "");
    let findings = check_rig_text(&text, &EmulatedBoard::refusals);
    let findings = findings.into_iter().filter(|it| it.severity == Severity::Error);
    let findings: Vec<_> = findings.map(|it| (it.values, it.problem, it.allowed)).collect();
    match &findings[..] {
        [] => String::new(),
        [(values, problem, allowed)] if values.len() == 1 && allowed.is_empty() => {
            let (key, value) = &values[0];
            format!("{} = {value} {problem}", key.rsplit('.').next().expect("a key"))
        }
        several => panic!("{settings}: {several:?}"),
    }
}

#[test]
fn a_current_beyond_its_limits_is_one_mistake_with_the_limits_of_the_resistor() {
    let with = "is out of range: with `sense_resistor =";
    let these = "is out of range: with these `run_current` and `sense_resistor` it is from";
    for (settings, says) in [
        (
            "run_current = 1.4, sense_resistor = 0.15",
            format!("run_current = 1.4 {with} 0.15` it is from 0.024 to 1.351 A"),
        ),
        (
            "run_current = 1.9",
            format!("run_current = 1.9 {with} 0.11` it is from 0.031 to 1.767 A"),
        ),
        (
            "run_current = 0.01, sense_resistor = 0.05",
            format!("run_current = 0.01 {with} 0.05` it is from 0.057 to 2 A"),
        ),
        (
            "run_current = 0.8, hold_current = 0.9",
            format!("hold_current = 0.9 {these} 0.031 to 0.8 A"),
        ),
        (
            "run_current = 1.2, hold_current = 0.01, sense_resistor = 0.15",
            format!("hold_current = 0.01 {these} 0.043 to 1.2 A"),
        ),
    ] {
        assert_eq!(problem(settings), says);
    }
}

#[test]
fn the_limits_of_a_current_are_accepted() {
    for sense in [0.05, 0.075, 0.1, 0.11, 0.15, 0.22, 0.5, 1.0] {
        let settings = |run: f64, hold: f64| {
            format!("run_current = {run}, hold_current = {hold}, sense_resistor = {sense}")
        };
        let limits = |text: &str| {
            let (_, limits) = text.split_once(" from ").expect("limits");
            let (least, most) = limits.trim_end_matches(" A").split_once(" to ").expect("two");
            [least, most].map(|limit| limit.parse::<f64>().expect("a number"))
        };
        let [least, most] = limits(&problem(&settings(0.001, 0.001)));
        assert_eq!(problem(&settings(least, least)), "");
        assert_eq!(problem(&settings(most, most)), "");
        let [least, _] = limits(&problem(&settings(most, 0.001)));
        assert_eq!(problem(&settings(most, least)), "");
    }
}

#[test]
fn a_pico_has_the_uart_at_the_pins_of_uart1() {
    let on_a_pico = |pins: &str| {
        let text = text("{ tmc2209-uart = { run_current = 0.8 } }", pins);
        keys(&text.replacen("skr-pico", "pico", 1), Severity::Error)
    };
    for pins in ["", "pins.uart = [8, 9]", "pins.uart = [20, 21]", "pins.uart = [8, 21]"] {
        assert_eq!(on_a_pico(pins), [""; 0], "{pins}");
    }
    // No UART1, in use by DIR of A, and the other way round.
    for pins in ["[10, 11]", "[4, 9]", "[9, 8]", "[0, 1]", "[24, 9]"] {
        assert_eq!(on_a_pico(&format!("pins.uart = {pins}"))[0], "board.pins.uart", "{pins}");
    }
}

#[test]
fn drivers_of_a_board_that_are_left_without_their_uart_are_a_warning() {
    let text = text("\"tmc2209\"", "");
    assert_eq!(keys(&text, Severity::Error), [""; 0]);
    assert_eq!(keys(&text, Severity::Warning), ["motors.driver"]);
    let pico = text.replacen("skr-pico", "pico", 1);
    assert_eq!(keys(&pico, Severity::Warning), [""; 0]);
}
