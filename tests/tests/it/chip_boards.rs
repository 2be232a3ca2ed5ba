//! The real firmware in the emulated chip with other boards and drivers: ENABLE, its polarity and
//! its time, and wirings that are refused.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use plumb_protocol::boards::{PIN_COUNT, SKR_PICO, UART};
use plumb_protocol::message::{Command, Fault, Hello, Jog, Refusal, State};
use plumb_protocol::units::{Milliseconds, Rate, Steps16};
use plumb_protocol::wiring::{
    Drivers, EnablePins, EnablePolarity, Line, Pin, PinError, StepDir, Wiring, WiringError,
};
use plumb_tests::chip::{
    CYCLES_PER_US, Chip, EMERGENCY, EMERGENCY_FILTER_US, ENABLE, fast_config, firmware_image,
};
use serde_json::json;

/// LED of a board without a configuration.
const LED: u8 = 25;

fn jog(motor: u8, steps: i32) -> Command {
    let rate = Rate::from_si(400.0).expect("a rate");
    Command::Jog(Jog { motor, distance: Steps16(16 * steps), rate })
}

/// Returns the wiring of a Pico with DM542 drivers.
fn dm542() -> Wiring {
    let mut wiring = Wiring::pico(Drivers::StepDir(StepDir::DM542));
    wiring.pins.polarity = EnablePolarity::OptoOffHigh;
    wiring
}

/// Returns the wiring of an SKR Pico.
fn skr_pico() -> Wiring {
    let drivers = Drivers::StepDir(StepDir::TMC2209);
    Wiring { board: SKR_PICO.kind, pins: SKR_PICO.pins, drivers }
}

/// Checks that every pin but those of the link and the LED follows the level from outside.
fn assert_nothing_is_driven(chip: &mut Chip) {
    for pin in (0..PIN_COUNT).filter(|pin| !UART.contains(pin) && *pin != LED) {
        for level in [1, 0] {
            chip.drive_pin(pin, Some(level));
            assert_eq!(chip.pin_level(pin), u64::from(level), "GP{pin} is no input");
        }
        chip.drive_pin(pin, None);
    }
}

#[test]
fn no_pin_is_driven_before_a_configuration_nor_by_one_that_is_refused() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    assert_nothing_is_driven(&mut chip);
    chip.request(Command::Hello(Hello::OURS));
    let mut wirings = [Wiring::example(), skr_pico(), Wiring::example()];
    wirings[0].pins.motors[1].direction = Pin::new(23);
    wirings[1].pins.emergency = Pin::new(21);
    wirings[2].board = plumb_protocol::boards::PICO_2.kind;
    let errors = [
        WiringError::Pin(Line::Direction(1), PinError::Taken),
        WiringError::Pin(Line::Emergency, PinError::Taken),
        WiringError::Board,
    ];
    let config = fast_config(400.0, StepDir::TMC2209).config;
    for (wiring, error) in wirings.into_iter().zip(errors) {
        assert_eq!(chip.request(Command::Wire(wiring)), Some(Refusal::Wiring(error)));
        assert_eq!(chip.request(Command::Configure(config)), Some(Refusal::NotWired));
        assert_nothing_is_driven(&mut chip);
    }
    // A wiring alone changes nothing.
    assert_eq!(chip.request(Command::Wire(skr_pico())), None);
    assert_nothing_is_driven(&mut chip);
}

/// Returns the cycles of the edges of a pin to this level since the last query.
fn edges(reply: &serde_json::Value, pin: u8, level: u8) -> Vec<u64> {
    let edges = reply["edges"].as_array().into_iter().flatten();
    let of = edges.filter(|edge| edge[1] == pin && edge[2] == level);
    of.filter_map(|edge| edge[0].as_u64()).collect()
}

/// The current of the opto-coupler goes off with the configuration; the jog that comes at once
/// waits until 200 ms after that.
#[test]
fn a_dm542_gets_its_pulses_after_the_time_of_its_enable() {
    let Some(image) = firmware_image() else { return };
    let wiring = dm542();
    let mut chip = Chip::start(&image);
    chip.request(Command::Hello(Hello::OURS));
    chip.request(Command::Wire(wiring));
    chip.execute(json!({ "list": [ENABLE, 2] }));
    let mut config = fast_config(400.0, StepDir::DM542).config;
    config.deadlines.host = Milliseconds(5000);
    let mut frames = chip.frame(Command::Configure(config));
    frames.extend(chip.frame(jog(0, 20)));
    let reply = chip.send(&frames, 500_000);
    let [on] = edges(&reply, ENABLE, 0)[..] else { panic!("{reply}") };
    let first = edges(&reply, 2, 1)[0];
    let us = (first - on) / CYCLES_PER_US;
    assert!((200_000..210_000).contains(&us), "{us} µs from ENABLE to STEP");
    assert_eq!(chip.state(), State::Ready);
    assert_eq!(chip.motors, [20.0, 0.0, 0.0]);
    // From then on a jog begins at once.
    let frame = chip.frame(jog(0, 20));
    let sent = chip.cycle;
    let reply = chip.send(&frame, 20_000);
    assert!(edges(&reply, 2, 1)[0] - sent < 10_000 * CYCLES_PER_US);
}

/// The wiring in force with other limits touches no pin: no driver sees a pulse, a direction or an
/// ENABLE. STEP of motor A is inverted: as an input with its pull-down it would be at its active
/// level.
#[test]
fn a_configuration_with_the_wiring_in_force_touches_no_pin() {
    let Some(image) = firmware_image() else { return };
    let mut wiring = Wiring::example();
    wiring.pins.motors[0].step.inverted = true;
    let mut config = fast_config(400.0, StepDir::TMC2209).config;
    let mut chip = Chip::start_with(&image, &wiring.pins).wired(wiring, config);
    chip.run_us(1000);
    let motors = wiring.pins.motors.iter().flat_map(|pins| [pins.step, pins.direction]);
    let mut pins: Vec<u8> = motors.map(|pin| pin.number).collect();
    pins.extend(wiring.pins.enable.numbers());
    chip.execute(json!({ "list": pins }));
    for _ in 0..3 {
        config.motors[0].max_rate.0 /= 2;
        chip.request(Command::Hello(Hello::OURS));
        assert_eq!(chip.request(Command::Wire(wiring)), None);
        let frame = chip.frame(Command::Configure(config));
        let reply = chip.send(&frame, 20_000);
        assert_eq!(reply["edges"], serde_json::Value::Null, "{reply}");
    }
    assert_eq!(chip.state(), State::Ready);
    assert_eq!(chip.pin_level(ENABLE), 0, "on");
    assert_eq!(chip.request(jog(1, 5)), None);
    chip.run_us(100_000);
    assert_eq!(chip.motors[1], 5.0);
}

/// Another wiring switches the drivers off. STEP and DIR that it has too keep their levels, and a
/// pin that it has not goes to its idle level.
#[test]
fn another_wiring_gives_no_pulse() {
    let Some(image) = firmware_image() else { return };
    let mut wiring = Wiring::example();
    wiring.pins.motors[0].step.inverted = true;
    wiring.pins.motors[1].step.inverted = true;
    let former = wiring.pins.motors[1].step.number;
    let config = fast_config(400.0, StepDir::TMC2209).config;
    let mut chip = Chip::start_with(&image, &wiring.pins).wired(wiring, config);
    chip.run_us(1000);
    chip.execute(json!({ "list": [wiring.pins.motors[0].step.number, former, ENABLE] }));
    wiring.pins.motors[1].step = Pin::inverted(28);
    wiring.pins.enable = EnablePins::Shared(22);
    assert_eq!(chip.request(Command::Wire(wiring)), None);
    let frame = chip.frame(Command::Configure(config));
    let reply = chip.send(&frame, 20_000);
    let edges_of = |pin| [0, 1].map(|level| edges(&reply, pin, level).len());
    assert_eq!([wiring.pins.motors[0].step.number, former].map(edges_of), [[0, 0]; 2], "{reply}");
    assert_eq!(edges_of(ENABLE), [0, 1], "the former ENABLE goes off and stays off");
    assert_eq!((chip.pin_level(former), chip.pin_level(22)), (1, 0));
}

/// Opens the emergency input while the processor hangs. Returns the cycle.
fn open_without_processor(image: &Path, wiring: Wiring) -> Chip {
    let config = fast_config(400.0, StepDir::TMC2209).config;
    let mut chip = Chip::start_with(image, &wiring.pins).wired(wiring, config);
    chip.run_us(1000);
    chip.hang();
    let emergency = wiring.pins.emergency;
    chip.drive_pin(emergency.number, Some(u8::from(!emergency.inverted)));
    chip
}

#[test]
fn the_monitor_gives_an_opto_coupler_its_current_without_the_processor() {
    let Some(image) = firmware_image() else { return };
    let mut chip = open_without_processor(&image, dm542());
    chip.run_us(EMERGENCY_FILTER_US - 1);
    assert_eq!(chip.pin_level(ENABLE), 0, "no current: the motors are on");
    chip.run_us(2);
    chip.drive_pin(ENABLE, Some(0));
    assert_eq!(chip.pin_level(ENABLE), 1, "the pin drives the current");
}

#[test]
fn the_monitor_lets_go_of_three_enable_pins_at_once_without_the_processor() {
    let Some(image) = firmware_image() else { return };
    let mut chip = open_without_processor(&image, skr_pico());
    chip.execute(json!({ "list": [12, 7, 2] }));
    let reply = chip.run_us(EMERGENCY_FILTER_US + 1);
    let at = [12, 7, 2].map(|pin| edges(&reply, pin, 1));
    assert!(at[0].len() == 1 && at[0] == at[1] && at[1] == at[2], "{at:?}");
}

/// The loop of an inverted emergency input is at 3.3 V: an open one is low.
#[test]
fn inverted_pins_are_inverted() {
    let Some(image) = firmware_image() else { return };
    let mut wiring = Wiring::example();
    wiring.pins.polarity = EnablePolarity::ActiveHigh;
    wiring.pins.emergency = Pin::inverted(EMERGENCY);
    wiring.pins.motors[0].step = Pin::inverted(9);
    let config = fast_config(400.0, StepDir::TMC2209).config;
    let mut chip = Chip::start_with(&image, &wiring.pins).wired(wiring, config);
    chip.run_us(1000);
    assert_eq!((chip.pin_level(ENABLE), chip.pin_level(9)), (1, 1), "on, and STEP at rest");
    chip.execute(json!({ "list": [9] }));
    let frame = chip.frame(jog(0, 5));
    let reply = chip.send(&frame, 100_000);
    let [falls, rises] = [0, 1].map(|level| edges(&reply, 9, level));
    assert_eq!((falls.len(), rises.len()), (80, 80), "5 steps of 16 pulses");
    assert!(falls[0] < rises[0], "a pulse is low");
    chip.drive_pin(EMERGENCY, None);
    chip.run_us(1000);
    assert_eq!(chip.pin_level(ENABLE), 0);
    assert_eq!(chip.state(), State::Fault(Fault::EmergencyStop));
}
