//! The real firmware in the emulated chip: flash and UART.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use nalgebra::Point3;
use plumb_emulator::plant::{Geometry, Plant, QuasiStatic, Task};
use plumb_protocol::config::{Estimated, Law};
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::{Command, FromBoard, Hello, Jog, Refusal, State};
use plumb_protocol::provenance::{BoardKind, RELEASE};
use plumb_protocol::units::{Milliseconds, Rate, RelativeTension, Steps16};
use plumb_protocol::wiring::StepDir;
use plumb_protocol::{Config, MOTORS};
use plumb_tests::chip::{Chip, ENABLE, fast_config, firmware_image};
use serde_json::json;

const JOG: Jog = Jog { motor: 0, distance: Steps16(160), rate: Rate(100 << 8) };

/// Stores the board's configuration and returns the time until it is written, µs, at most 1 s.
fn store(chip: &mut Chip) -> u64 {
    write_flash(chip, Command::Store)
}

/// Sends a command that writes the flash, and returns the time until that is done, µs, at most 1 s.
fn write_flash(chip: &mut Chip, command: Command) -> u64 {
    let (before, began) = (chip.received.len(), chip.us());
    let frame = chip.frame(command);
    chip.send(&frame, 0);
    for _ in 0..1000 {
        chip.run_us(1000);
        if chip.received[before..]
            .iter()
            .any(|m| matches!(m, FromBoard::Answer(a) if a.refusal.is_none()))
        {
            return chip.us() - began;
        }
    }
    panic!("not written: {:?}", &chip.received[before..]);
}

/// Returns whether a board that has just started has `config`: it accepts a jog at the maximum rate
/// and refuses a faster one.
fn has_config(chip: &mut Chip, config: &Config) -> bool {
    let rate = config.motors[0].max_rate;
    let mut refusal = |rate| {
        let refusal = chip.request(Command::Jog(Jog { rate, distance: Steps16(16), ..JOG }));
        chip.stop_and_wait();
        refusal
    };
    refusal(Rate(rate.0 + 256)) == Some(Refusal::JogRate) && refusal(rate).is_none()
}

#[test]
fn a_stored_configuration_survives_power_off_without_motion_before_hello() {
    let Some(image) = firmware_image() else { return };
    let config = fast_config(400.0, StepDir::A4988);
    let mut chip = Chip::start(&image).configured(config);
    let took = store(&mut chip);
    assert!((45_000..60_000).contains(&took), "{took} µs for a sector of 45 ms and a page");
    // The pull-up resistor of the enable line.
    chip.drive_pin(ENABLE, Some(1));
    chip.power_cycle();
    assert_eq!(chip.request(Command::Jog(JOG)), Some(Refusal::NotGreeted));
    chip.run_us(300_000);
    assert_eq!(chip.pulses().map(|pulses| pulses.count), [0; 3]);
    assert_eq!(chip.pin_level(ENABLE), 1, "no current before a Hello");
    chip.request(Command::Hello(Hello::OURS));
    assert_eq!(chip.state(), State::Ready);
    assert_eq!(chip.pin_level(ENABLE), 0);
    assert!(has_config(&mut chip, &config));
}

/// Drives a ball on the paper's rig to `target` for some pictures. Returns the tensions that the
/// board tells at the end. The motors are where they are when the ball hangs as in `plant`.
fn drive(
    chip: &mut Chip,
    plant: &mut QuasiStatic,
    target: Point3<f64>,
    pictures: u32,
) -> [f64; MOTORS] {
    let micrometres = |place: Point3<f64>| [0, 1, 2].map(|i| (place[i] * 1e6) as i32);
    let zero = chip.status().motors.map(Steps16::to_si);
    let start = plant.ball();
    *plant = QuasiStatic::new(Geometry::paper(), start).expect("the paper's rig");
    chip.seek(micrometres(start), micrometres(target));
    for _ in 0..pictures {
        chip.run_us(30_000);
        let motors = chip.status().motors.map(Steps16::to_si);
        let turned = std::array::from_fn(|k| motors[k] - zero[k]);
        plant.advance(0.033, turned).expect("the ball hangs");
        chip.send_position(micrometres(plant.ball()));
    }
    chip.run_us(30_000);
    let tensions = chip.status().tensions.expect("the law taut tells them");
    tensions.map(RelativeTension::to_si).steppable(0.0)
}

/// What the law taut has learnt of the rig is stored with the configuration. After power-off the
/// board tells the tensions as before, at its first position; without it, others.
#[test]
fn what_a_law_has_learnt_survives_power_off() {
    let Some(image) = firmware_image() else { return };
    let (start, middle) = (Task::paper().start, Point3::new(0.62, 0.27, 0.25));
    let setup = fast_config(110.0, StepDir::A4988)
        .with_law(Law::Taut(Estimated { delay: Milliseconds(0) }));
    let [cold, warm] = [false, true].map(|is_stored_later| {
        let mut chip = Chip::start(&image).configured(setup);
        let mut plant = QuasiStatic::new(Geometry::paper(), start).expect("the paper's rig");
        if !is_stored_later {
            store(&mut chip);
        }
        let before = drive(&mut chip, &mut plant, middle, 60);
        chip.stop_and_wait();
        if is_stored_later {
            store(&mut chip);
        }
        chip.power_cycle();
        chip.request(Command::Hello(Hello::OURS));
        let after = drive(&mut chip, &mut plant, start, 1);
        (0..MOTORS).map(|k| (after[k] - before[k]).abs()).fold(0.0, f64::max)
    });
    assert!(warm < 0.06 && warm < cold / 1.5, "{warm} with it, {cold} without");
}

/// Cuts the power at twelve times of the second Store: while the sector is erased, while the page
/// is written, and afterwards.
#[test]
fn a_test_of_the_flash_leaves_the_stored_configuration() {
    let Some(image) = firmware_image() else { return };
    let config = fast_config(400.0, StepDir::A4988);
    let mut chip = Chip::start(&image).configured(config);
    store(&mut chip);
    for _ in 0..2 {
        write_flash(&mut chip, Command::TestFlash);
    }
    chip.power_cycle();
    chip.request(Command::Hello(Hello::OURS));
    assert!(has_config(&mut chip, &config));
}

#[test]
fn a_power_cut_while_storing_leaves_the_old_or_the_new_configuration() {
    let Some(image) = firmware_image() else { return };
    let [old, new] = [400.0, 500.0].map(|rate| fast_config(rate, StepDir::A4988));
    let mut kept = [0, 0];
    for moment in
        [0, 500, 1_500, 2_500, 10_000, 25_000, 40_000, 46_000, 46_600, 46_900, 47_200, 55_000]
    {
        let mut chip = Chip::start(&image).configured(old);
        store(&mut chip);
        for command in new.commands() {
            assert_eq!(chip.request(command), None);
        }
        let frame = chip.frame(Command::Store);
        chip.send(&frame, moment);
        chip.power_cycle();
        chip.request(Command::Hello(Hello::OURS));
        assert_eq!(chip.state(), State::Ready, "cut after {moment} µs");
        let which = [old, new].iter().position(|config| has_config(&mut chip, config));
        kept[which.unwrap_or_else(|| panic!("neither, cut after {moment} µs"))] += 1;
    }
    assert!(kept[0] >= 5 && kept[1] >= 1, "{kept:?}");
}

/// Sends commands over the UART and returns the messages received.
fn over_uart(chip: &mut Chip, commands: &[Command]) -> Vec<FromBoard> {
    let bytes: Vec<u8> = commands.iter().flat_map(|&command| chip.frame(command)).collect();
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    chip.execute(json!({ "uart": hex }));
    let reply = chip.run_us(100_000);
    let mut accumulator = Accumulator::new();
    let hex = reply["uart"][0][1].as_str().unwrap_or_default();
    let bytes = (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16));
    bytes
        .filter_map(|byte| accumulator.push(byte.ok()?))
        .map(|m| m.expect("whole frames"))
        .collect()
}

/// The board accepts Hello, a configuration and a jog over the UART. It ignores USB until the UART
/// is silent.
#[test]
fn the_uart_controls_the_board_until_it_is_silent() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let [wire, configure] = fast_config(400.0, StepDir::A4988).commands();
    let setting_up = [Command::Hello(Hello::OURS), wire, configure];
    let replies = over_uart(&mut chip, &setting_up);
    let [
        FromBoard::Hello(hello),
        FromBoard::Provenance(provenance),
        FromBoard::Started(_),
        FromBoard::Answer(_),
        FromBoard::Answer(answer),
        ..,
    ] = replies[..]
    else {
        panic!("{replies:?}")
    };
    assert!(hello.accepted && answer.refusal.is_none(), "{replies:?}");
    assert_eq!((provenance.release, provenance.board), (RELEASE, BoardKind::Pico));
    over_uart(&mut chip, &[Command::Jog(JOG)]);
    over_uart(&mut chip, &[Command::Status]);
    assert_eq!(chip.motors, [10.0, 0.0, 0.0]);

    let hello = chip.frame(Command::Hello(Hello::OURS));
    chip.send(&hello, 10_000);
    assert_eq!(chip.received, [], "the UART has control");
    chip.run_us(1_100_000);
    chip.request(Command::Hello(Hello::OURS));
    chip.execute(json!({ "unplug": true }));
    chip.run_us(50_000);
    chip.execute(json!({ "plug": true }));
    chip.wait_for_usb();
    chip.request(Command::Hello(Hello::OURS));
}

/// Noise on the UART, and a frame that is cut off there, delay no frame of USB.
#[test]
fn noise_on_the_uart_takes_nothing_from_usb() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let mut cut = chip.frame(Command::Status);
    cut.truncate(cut.len() / 2);
    let noise = [0x55, 0, 0xff, 0x07, 0, 0x13].iter().chain(&cut);
    let noise: String = noise.map(|byte| format!("{byte:02x}")).collect();
    chip.execute(json!({ "uart": noise }));
    chip.run_us(2_000);
    assert_eq!(chip.request(Command::Hello(Hello::OURS)), None);
    chip.execute(json!({ "uart": noise }));
    chip.run_us(2_000);
    let telemetry = chip.status();
    assert_eq!(telemetry.bad_frames, 0, "noise of another link is no frame of this one");
}
