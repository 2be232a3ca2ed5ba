//! The real firmware in the emulated chip, on the pins of an SKR Pico with four emulated TMC2209 on
//! one UART: X, Y, Z turn motors A, B, C, and E turns none.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use plumb_protocol::MotorList;
use plumb_protocol::boards::SKR_PICO;
use plumb_protocol::message::{
    Command, DriverFault, DriverReading, Fault, FromBoard, Hello, Jog, State,
};
use plumb_protocol::units::{Acceleration, Milliamperes, Milliseconds, Rate, Steps16};
use plumb_protocol::wiring::{Drivers, StepDir, Tmc2209, Wiring};
use plumb_tests::chip::{Chip, fast_config, firmware_image};
use serde_json::json;

/// ENABLE of the drivers of motors A, B and C: low is on.
const ENABLES: [u8; 3] = [12, 7, 2];
/// TX of the drivers' UART.
const UART_TX: u8 = 8;
/// Longest time from a fault of a driver to its report, ms.
const LIMIT_MS: u32 = 50;

/// Preparation of the drivers before the board is configured.
type Prepare = fn(&mut Chip);

fn wiring() -> Wiring {
    let drivers = Drivers::Tmc2209(Tmc2209 { hold: Milliamperes(500), ..Tmc2209::of(&SKR_PICO) });
    Wiring { board: SKR_PICO.kind, pins: SKR_PICO.pins, drivers }
}

/// Returns a board with its drivers that was sent `wiring` and a configuration.
fn configured(image: &Path, wiring: Wiring, prepare: impl Fn(&mut Chip)) -> Chip {
    let mut chip = Chip::start_with(image, &wiring.pins);
    chip.plug_in_skr_drivers();
    prepare(&mut chip);
    let mut config = fast_config(400.0, StepDir::TMC2209).config;
    config.deadlines.host = Milliseconds(5000);
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(4000));
    chip.wired(wiring, config)
}

/// Returns a board whose drivers are set up and take pulses.
fn ready(image: &Path) -> Chip {
    let mut chip = configured(image, wiring(), |_| {});
    chip.run_us(300_000);
    assert_eq!(chip.state(), State::Ready);
    assert!(are_on(&mut chip));
    chip
}

fn are_on(chip: &mut Chip) -> bool {
    let levels = ENABLES.map(|pin| chip.pin_level(pin));
    assert!(levels == [0; 3] || levels == [1; 3], "{levels:?}");
    levels == [0; 3]
}

fn jog(chip: &mut Chip, motor: u8, steps: i32) {
    let rate = Rate::from_si(100.0).expect("a rate");
    let jog = Jog { motor, distance: Steps16(16 * steps), rate };
    assert_eq!(chip.request(Command::Jog(jog)), None);
}

/// Changes the conditions of driver `index`.
fn disturb(chip: &mut Chip, index: usize, what: &str, value: serde_json::Value) {
    chip.execute(json!({ "driver": { "index": index, what: value } }));
}

/// Runs the chip until the board reports a fault of a driver. Returns it, and the time, ms.
fn fault(chip: &mut Chip) -> (DriverFault, u32) {
    let before = chip.received.len();
    for ms in 1..=400 {
        chip.run_us(1000);
        let fault = chip.received[before..].iter().find_map(|message| match message {
            FromBoard::Fault(report) => Some(report.fault),
            _ => None,
        });
        if let Some(fault) = fault {
            let Fault::Driver(fault) = fault else { panic!("{fault}") };
            return (fault, ms);
        }
    }
    panic!("no fault in 0.4 s");
}

/// Returns the newest readings since message number `after`.
fn readings(chip: &Chip, after: usize) -> Option<MotorList<DriverReading>> {
    chip.received[after..].iter().rev().find_map(|message| match message {
        FromBoard::Drivers(report) => Some(report.motors),
        _ => None,
    })
}

#[test]
fn the_drivers_are_set_up_get_current_and_turn_the_motors() {
    let Some(image) = firmware_image() else { return };
    let mut chip = configured(&image, wiring(), |_| {});
    assert!(!are_on(&mut chip), "not before they are set up");
    chip.run_us(60_000);
    assert!(!are_on(&mut chip), "nor before their addresses are checked");
    chip.run_us(240_000);
    assert!(are_on(&mut chip));
    let late = chip.counter(&image, "LATE_TICKS");
    for (motor, steps) in [(0, 20), (1, -30), (2, 25)] {
        jog(&mut chip, motor, steps);
        chip.run_us(100_000);
        // 0.8 A while it turns, and 0.5 A a while after its last step.
        let drivers = chip.execute(json!({ "drivers": true }))["drivers"].take();
        let current = drivers[usize::from(motor)]["milliamperes"].as_i64().expect("a current");
        assert!((785..=815).contains(&current), "{current} mA");
        chip.run_us(500_000);
    }
    assert_eq!(chip.counter(&image, "LATE_TICKS"), late, "no step was delayed");
    assert_eq!(chip.status().motors.map(Steps16::to_si), [20.0, -30.0, 25.0]);
    assert_eq!(chip.motors, [20.0, -30.0, 25.0]);
    let reply = chip.execute(json!({ "drivers": true }));
    let of = |index: usize, name: &str| reply["drivers"][index][name].as_i64().expect(name);
    // DIR of X and Y is inverted.
    let positions = [0, 1, 2].map(|index| of(index, "position"));
    assert_eq!(positions, [-20 * 256, 30 * 256, 25 * 256], "the drivers' own count");
    assert_eq!([0, 1, 2].map(|index| of(index, "microsteps")), [16; 3]);
    for index in 0..3 {
        assert!((485..=515).contains(&of(index, "milliamperes")), "{reply}");
    }
    assert_eq!((of(3, "milliamperes"), of(3, "writes")), (0, 1), "E is off");
}

/// Milliamperes and writes of each driver.
fn drivers(chip: &mut Chip) -> [[i64; 2]; 4] {
    let reply = chip.execute(json!({ "drivers": true }));
    [0, 1, 2, 3].map(|index| {
        ["milliamperes", "writes"].map(|name| reply["drivers"][index][name].as_i64().expect(name))
    })
}

#[test]
fn a_configuration_with_the_wiring_in_force_keeps_every_driver_and_its_current() {
    let Some(image) = firmware_image() else { return };
    let mut chip = ready(&image);
    let before = drivers(&mut chip);
    let motors = wiring().pins.motors;
    let steps = motors.iter().flat_map(|pins| [pins.step.number, pins.direction.number]);
    chip.execute(json!({ "list": steps.chain(ENABLES).collect::<Vec<_>>() }));
    let mut config = fast_config(200.0, StepDir::TMC2209).config;
    config.deadlines.host = Milliseconds(5000);
    let mut frames = chip.frame(Command::Hello(Hello::OURS));
    frames.extend(chip.frame(Command::Wire(wiring())));
    frames.extend(chip.frame(Command::Configure(config)));
    let mut reply = chip.send(&frames, 1000);
    for _ in 0..200 {
        assert_eq!(reply["edges"], serde_json::Value::Null, "{reply}");
        assert!(drivers(&mut chip)[..3].iter().all(|driver| driver[0] > 0), "a current");
        reply = chip.run_us(1000);
    }
    assert_eq!(drivers(&mut chip), before, "and no write");
    assert_eq!(chip.state(), State::Ready);
}

#[test]
fn clear_after_a_fault_of_a_driver_keeps_the_current_of_the_others() {
    let Some(image) = firmware_image() else { return };
    let mut chip = ready(&image);
    let before = drivers(&mut chip);
    disturb(&mut chip, 1, "reset", json!(true));
    assert_eq!(fault(&mut chip).0, DriverFault::Reset(1));
    let frame = chip.frame(Command::ClearFault);
    chip.send(&frame, 1000);
    for _ in 0..200 {
        let now = drivers(&mut chip);
        assert!(now[0][0] > 0 && now[2][0] > 0, "{now:?}");
        chip.run_us(1000);
    }
    let after = drivers(&mut chip);
    assert_eq!((after[0], after[2]), (before[0], before[2]), "no write");
    assert_eq!(after[1], [before[1][0], before[1][1] + 11], "its settings again");
    assert_eq!(chip.state(), State::Ready);
}

#[test]
fn a_warm_driver_is_a_warning_and_the_motor_turns_on() {
    let Some(image) = firmware_image() else { return };
    let mut chip = ready(&image);
    let cool = readings(&chip, 0).expect("readings");
    assert_eq!(cool.map(|it| (it.is_hot, it.has_open_load)), [(false, false); 3]);
    jog(&mut chip, 1, 100);
    chip.run_us(100_000);
    let before = chip.received.len();
    disturb(&mut chip, 1, "temperature", json!(130));
    disturb(&mut chip, 1, "stallGuard", json!(240));
    chip.run_us(u64::from(LIMIT_MS) * 1000);
    let hot = readings(&chip, before).expect("readings");
    assert_eq!(hot.map(|it| it.is_hot), [false, true, false]);
    // An open coil counts while the motor turns.
    disturb(&mut chip, 1, "hasOpenLoad", json!(true));
    disturb(&mut chip, 2, "hasOpenLoad", json!(true));
    chip.run_us(200_000);
    let open = readings(&chip, before).expect("readings");
    assert_eq!(open.map(|it| it.has_open_load), [false, true, false], "motor C stands");
    assert_eq!(open[1].stall_guard, Some(240));
    chip.run_us(1_500_000);
    assert_eq!(chip.state(), State::Ready);
    assert_eq!(chip.motors, [0.0, 100.0, 0.0]);
    let after = readings(&chip, before).expect("readings");
    assert_eq!(after.map(|it| it.has_open_load), [false; 3], "all stand");
}

#[test]
fn a_fault_of_a_driver_stops_the_board_and_can_be_cleared_once_it_is_over() {
    let Some(image) = firmware_image() else { return };
    let mut chip = ready(&image);
    let faults: [(&str, serde_json::Value, serde_json::Value, DriverFault); 5] = [
        ("isShorted", json!(true), json!(false), DriverFault::Short(1)),
        ("temperature", json!(160), json!(25), DriverFault::Overtemperature(1)),
        ("isUndervolted", json!(true), json!(false), DriverFault::Undervoltage(1)),
        ("isSilent", json!(true), json!(false), DriverFault::Silent(1)),
        ("reset", json!(true), json!(false), DriverFault::Reset(1)),
    ];
    for (what, on, off, expected) in faults {
        jog(&mut chip, 0, 200);
        chip.run_us(100_000);
        disturb(&mut chip, 1, what, on);
        let (found, ms) = fault(&mut chip);
        println!("{expected:?} after {ms} ms");
        assert_eq!(found, expected);
        // A silent driver counts as lost after 0.3 s.
        let lost = if what == "isSilent" { 300 } else { 0 };
        assert!((lost..=lost + LIMIT_MS).contains(&ms), "{what}: {ms} ms");
        chip.run_us(300_000);
        assert_eq!(chip.status().rates, [Rate(0); 3], "the motors have ramped down");
        assert!(are_on(&mut chip), "and hold");
        if what != "reset" {
            assert_eq!(chip.request(Command::ClearFault), None);
            assert_eq!(fault(&mut chip).0, expected, "as long as it lasts");
        }
        disturb(&mut chip, 1, what, off);
        assert_eq!(chip.request(Command::ClearFault), None);
        chip.run_us(200_000);
        assert_eq!(chip.state(), State::Ready, "{what}");
    }
    let drivers = chip.execute(json!({ "drivers": true }))["drivers"].take();
    assert_eq!(drivers[1]["microsteps"], 16, "the driver that was reset has its settings again");
}

#[test]
fn drivers_that_cannot_be_set_up_get_no_current() {
    let Some(image) = firmware_image() else { return };
    let silent = |chip: &mut Chip| disturb(chip, 2, "isSilent", json!(true));
    let double = |chip: &mut Chip| disturb(chip, 3, "address", json!(2));
    let exchanged = |chip: &mut Chip| {
        disturb(chip, 0, "address", json!(1));
        disturb(chip, 2, "address", json!(0));
    };
    let cases: [(Prepare, DriverFault); 3] = [
        (silent, DriverFault::Silent(2)),
        (double, DriverFault::Address(1)),
        (exchanged, DriverFault::Address(0)),
    ];
    for (prepare, expected) in cases {
        let mut chip = configured(&image, wiring(), prepare);
        assert_eq!(fault(&mut chip).0, expected);
        chip.run_us(300_000);
        assert!(!are_on(&mut chip));
        // DIR is the step generator's again.
        jog_is_refused(&mut chip);
        for (index, address) in [(0, 0), (2, 1), (3, 3)] {
            disturb(&mut chip, index, "address", json!(address));
            disturb(&mut chip, index, "isSilent", json!(false));
        }
        assert_eq!(chip.request(Command::ClearFault), None);
        chip.run_us(300_000);
        assert_eq!(chip.state(), State::Ready);
        assert!(are_on(&mut chip));
        jog(&mut chip, 0, 5);
        chip.run_us(200_000);
        assert_eq!(chip.motors, [5.0, 0.0, 0.0]);
    }
}

fn jog_is_refused(chip: &mut Chip) {
    let jog = Jog { motor: 0, distance: Steps16(16), rate: Rate(256) };
    assert!(chip.request(Command::Jog(jog)).is_some());
}

#[test]
fn noise_on_the_wire_is_outlived() {
    let Some(image) = firmware_image() else { return };
    let mut chip = ready(&image);
    for _ in 0..20 {
        // Two damaged replies in a row: the third attempt is right.
        chip.execute(json!({ "driver": { "index": 0, "noise": 2 } }));
        chip.run_us(37_000);
    }
    assert_eq!(chip.state(), State::Ready);
    chip.execute(json!({ "driver": { "index": 0, "noise": 1000 } }));
    assert!(matches!(fault(&mut chip).0, DriverFault::BadReplies(_)));
}

/// Without the wiring of such drivers nothing is sent on the UART, and its pins are inputs.
#[test]
fn the_uart_is_used_for_its_drivers_only() {
    let Some(image) = firmware_image() else { return };
    let mut chip = ready(&image);
    let writes = |chip: &mut Chip| {
        let reply = chip.execute(json!({ "drivers": true }));
        reply["drivers"][0]["writes"].as_i64().expect("writes")
    };
    assert_eq!(writes(&mut chip), 1 + 11);
    let step_dir = Wiring { drivers: Drivers::StepDir(StepDir::TMC2209), ..wiring() };
    let before = chip.received.len();
    chip.request(Command::Hello(Hello::OURS));
    let config = fast_config(400.0, StepDir::TMC2209).config;
    let mut chip = chip.wired(step_dir, config);
    chip.run_us(10_000);
    let after = chip.received.len();
    chip.run_us(300_000);
    assert_eq!(readings(&chip, after), None, "nobody asks the drivers");
    assert!(after > before && are_on(&mut chip), "and they are on at once");
    for level in [1, 0] {
        chip.drive_pin(UART_TX, Some(level));
        assert_eq!(chip.pin_level(UART_TX), u64::from(level), "an input");
    }
    // The same drivers once more.
    chip.drive_pin(UART_TX, None);
    let mut chip = chip.wired(wiring(), config);
    chip.run_us(300_000);
    assert_eq!((chip.state(), writes(&mut chip)), (State::Ready, 2 * (1 + 11)));
}
