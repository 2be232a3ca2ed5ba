//! The real firmware in the emulated chip: flash, Motor HATs and UART.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeMap;

use plumb_protocol::Config;
use plumb_protocol::config::{Coils, Drivers, StepDir};
use plumb_protocol::frame::Accumulator;
use plumb_protocol::message::{Command, FromBoard, Hello, Jog, Refusal, State};
use plumb_protocol::units::{Acceleration, Rate, Steps16};
use plumb_tests::chip::{Chip, ENABLE, fast_config, firmware_image};
use serde_json::{Value, json};

const JOG: Jog = Jog { motor: 0, distance: Steps16(160), rate: Rate(100 << 8) };

/// Stores the board's configuration and returns the time until it is written, µs, at most 1 s.
fn store(chip: &mut Chip) -> u64 {
    let (before, began) = (chip.received.len(), chip.us());
    let frame = chip.frame(Command::Store);
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
    panic!("not stored: {:?}", &chip.received[before..]);
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

/// Cuts the power at twelve times of the second Store: while the sector is erased, while the page
/// is written, and afterwards.
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
        assert_eq!(chip.request(Command::Configure(new)), None);
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

/// Registers of the two HATs, as written over the bus.
#[derive(Default)]
struct Hats(BTreeMap<(u64, u64), u8>);

impl Hats {
    /// Applies the writes of a reply and returns their number.
    fn apply(&mut self, reply: &Value) -> usize {
        let writes = reply["i2c"].as_array().map_or(&[][..], Vec::as_slice);
        for write in writes {
            let (address, register) = (write[0].as_u64(), write[1].as_u64().expect("a register"));
            let hex = write[2].as_str().expect("bytes");
            for (at, digits) in (0..).zip(hex.as_bytes().chunks(2)) {
                let digits = std::str::from_utf8(digits).expect("digits");
                let byte = u8::from_str_radix(digits, 16).expect("hexadecimal");
                self.0.insert((address.expect("an address"), register + at), byte);
            }
        }
        writes.len()
    }

    /// Returns the duty of a channel, of 4095.
    fn duty(&self, address: u64, channel: u64) -> u16 {
        let byte = |at| *self.0.get(&(address, 8 + 4 * channel + at)).unwrap_or(&0);
        u16::from_le_bytes([byte(0), byte(1)]) & 0x1fff
    }

    /// Returns the signed drive of a bridge with the channels `[enable, forward, backward]`
    /// (Adafruit's schematic).
    fn drive(&self, address: u64, [enable, forward, backward]: [u64; 3]) -> i32 {
        let sign = i32::from(self.duty(address, forward) > 0)
            - i32::from(self.duty(address, backward) > 0);
        sign * i32::from(self.duty(address, enable))
    }
}

/// Motor A, on M1 and M2 of the first HAT, moves eight full steps: its field turns twice.
#[test]
fn motor_hats_turn_the_field_with_the_steps() {
    let Some(image) = firmware_image() else { return };
    let mut config = fast_config(250.0, StepDir::A4988);
    config.drivers = Drivers::MotorHats(Coils { duty_percent: 80 });
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(4000));
    let mut hats = Hats::default();
    let mut chip = Chip::start(&image);
    chip.execute(json!({ "i2c": [0, 0x60, "pca9685"] }));
    chip.execute(json!({ "i2c": [0, 0x61, "pca9685"] }));
    let frames =
        [Command::Hello(Hello::OURS), Command::Configure(config)].map(|c| chip.frame(c)).concat();
    assert!(hats.apply(&chip.send(&frames, 100_000)) > 10, "both are set up");

    let jog =
        Jog { motor: 0, distance: Steps16(8 * 16), rate: Rate::from_si(40.0).expect("a rate") };
    let frame = chip.frame(Command::Jog(jog));
    hats.apply(&chip.send(&frame, 0));
    let mut quadrants = Vec::new();
    for _ in 0..150 {
        hats.apply(&chip.run_us(2000));
        let coils = [hats.drive(0x60, [8, 10, 9]), hats.drive(0x60, [13, 11, 12])];
        let length = f64::from(coils[0]).hypot(f64::from(coils[1])) / (0.8 * 4095.0);
        assert!((0.85..1.05).contains(&length), "{coils:?}: a field as strong as asked for");
        let quadrant =
            (f64::from(coils[1]).atan2(f64::from(coils[0])) / std::f64::consts::FRAC_PI_2).round();
        quadrants.push((quadrant as i32).rem_euclid(4));
    }
    quadrants.dedup();
    assert_eq!(quadrants, [0, 1, 2, 3, 0, 1, 2, 3, 0], "four full steps are a turn");
    assert_eq!(chip.status().motors.map(Steps16::to_si), [8.0, 0.0, 0.0]);

    chip.set_emergency(true);
    hats.apply(&chip.run_us(5000));
    for (address, channel) in [0x60, 0x61].into_iter().flat_map(|a| (0..16).map(move |c| (a, c))) {
        assert_eq!(
            hats.duty(address, channel),
            0,
            "channel {channel} of {address:#x} after an emergency"
        );
    }
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
    let setting_up =
        [Command::Hello(Hello::OURS), Command::Configure(fast_config(400.0, StepDir::A4988))];
    let replies = over_uart(&mut chip, &setting_up);
    let [FromBoard::Hello(hello), FromBoard::Started(_), FromBoard::Answer(answer), ..] =
        replies[..]
    else {
        panic!("{replies:?}")
    };
    assert!(hello.accepted && answer.refusal.is_none(), "{replies:?}");
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
