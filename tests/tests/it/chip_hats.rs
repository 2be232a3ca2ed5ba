//! The real firmware in the emulated chip, with motors on Motor HATs.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeMap;
use std::path::Path;

use plumb_protocol::message::{Command, DriverFault, Fault, Hello, Jog, State};
use plumb_protocol::units::{Acceleration, Rate, Steps16};
use plumb_protocol::wiring::{Coils, Drivers, StepDir};
use plumb_tests::chip::{Chip, Setup, fast_config, firmware_image};
use serde_json::{Value, json};

/// Addresses of the HATs on bus 0.
const HATS: [u8; 2] = [0x60, 0x61];

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

    /// Returns whether no channel of either HAT is on.
    fn are_off(&self) -> bool {
        HATS.iter().all(|&hat| (0..16).all(|channel| self.duty(hat.into(), channel) == 0))
    }
}

/// Returns the wiring and the configuration of motors on HATs.
fn hat_setup() -> Setup {
    let mut config = fast_config(250.0, StepDir::A4988);
    config.drivers = Drivers::MotorHats(Coils { duty_percent: 80 });
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(4000));
    config
}

/// Plugs HATs onto the bus.
fn plug_in(chip: &mut Chip, hats: &[u8]) {
    for hat in hats {
        chip.execute(json!({ "i2c": [0, hat, "pca9685"] }));
    }
}

/// Returns a configured board with both HATs, and what it has written to them.
fn configured(image: &Path) -> (Chip, Hats) {
    let (mut chip, mut hats) = (Chip::start(image), Hats::default());
    plug_in(&mut chip, &HATS);
    let [wire, configure] = hat_setup().commands();
    let commands = [Command::Hello(Hello::OURS), wire, configure];
    let frames = commands.map(|command| chip.frame(command)).concat();
    assert!(hats.apply(&chip.send(&frames, 100_000)) > 10, "both are set up");
    (chip, hats)
}

/// Returns a jog of motor A by `steps` full steps.
fn jog(steps: i32) -> Jog {
    let rate = Rate::from_si(40.0).expect("a rate");
    Jog { motor: 0, distance: Steps16(steps * 16), rate }
}

/// Returns a configured board 0.2 s after the start of a jog of 400 steps, and what it had written
/// before.
fn jogging(image: &Path) -> (Chip, Hats) {
    let (mut chip, hats) = configured(image);
    assert_eq!(chip.request(Command::Jog(jog(400))), None);
    chip.run_us(200_000);
    (chip, hats)
}

/// Motor A, on M1 and M2 of the first HAT, moves eight full steps: its field turns twice.
#[test]
fn motor_hats_turn_the_field_with_the_steps() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = configured(&image);
    let frame = chip.frame(Command::Jog(jog(8)));
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
    assert!(hats.are_off(), "an emergency switches the current off");
}

/// HATs keep their outputs over a restart of the board, which therefore switches them off first.
#[test]
fn a_board_that_restarts_switches_the_hats_off() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = configured(&image);
    assert!(!hats.are_off());
    chip.hang();
    let reset = (0..200).any(|_| {
        let reply = chip.run_us(1000);
        hats.apply(&reply);
        !reply["resets"].is_null()
    });
    assert!(reset && !hats.are_off(), "the watchdog has restarted the board");
    hats.apply(&chip.run_us(20_000));
    assert!(hats.are_off(), "no host has said anything");
}

#[test]
fn the_bootloader_starts_with_the_hats_off() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = configured(&image);
    let frame = chip.frame(Command::Bootloader);
    let reply = chip.send(&frame, 50_000);
    hats.apply(&reply);
    assert_eq!(reply["resets"][0][1], "bootloader", "{reply}");
    assert!(hats.are_off());
}

#[test]
fn a_hat_that_does_not_answer_stops_the_board() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = jogging(&image);
    chip.execute(json!({ "i2c": [0, 0x61, null] }));
    // Motor A is on the other HAT: nothing of it is written until the field of C changes.
    chip.run_us(50_000);
    assert_eq!(chip.state(), State::Jogging);
    chip.execute(json!({ "i2c": [0, 0x60, null] }));
    chip.run_us(50_000);
    assert_eq!(chip.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
    chip.run_us(500_000);
    // As long as a HAT does not answer, the fault comes again.
    assert_eq!(chip.request(Command::ClearFault), None);
    chip.run_us(1000);
    assert_eq!(chip.state(), State::Fault(Fault::Driver(DriverFault::Hat)));

    plug_in(&mut chip, &HATS);
    hats.apply(&chip.run_us(200_000));
    assert_eq!(chip.request(Command::ClearFault), None);
    assert_eq!(chip.state(), State::Ready);
    assert!(!hats.are_off(), "the motors hold again");
}

#[test]
fn a_hat_that_does_not_answer_leaves_the_other_its_current() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = configured(&image);
    // Motor C is on the HAT that is unplugged.
    chip.execute(json!({ "i2c": [0, 0x61, null] }));
    let rate = Rate::from_si(50.0).expect("a rate");
    let jog = Jog { motor: 2, distance: Steps16(16 * 10), rate };
    assert_eq!(chip.request(Command::Jog(jog)), None);
    let reply = chip.run_us(500_000);
    assert_eq!(chip.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
    assert_eq!(reply["i2c"], serde_json::Value::Null, "nothing is written to the other one");
    hats.apply(&reply);
    assert!(!hats.are_off());
}

#[test]
fn a_hat_that_holds_the_bus_stops_the_board() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = jogging(&image);
    assert_eq!(chip.state(), State::Jogging);
    chip.execute(json!({ "hold_i2c": [0, true] }));
    chip.run_us(50_000);
    assert_eq!(chip.state(), State::Fault(Fault::Driver(DriverFault::Hat)));
    // The rates ramp down, and the positions stay those of the pulses.
    chip.run_us(500_000);
    let rest = chip.status().motors;
    chip.run_us(200_000);
    assert_eq!(chip.status().motors, rest);

    chip.execute(json!({ "hold_i2c": [0, false] }));
    hats.apply(&chip.run_us(500_000));
    assert_eq!(chip.request(Command::ClearFault), None);
    hats.apply(&chip.run_us(50_000));
    assert_eq!(chip.state(), State::Ready);
    assert!(!hats.are_off(), "the motors hold again");
}

/// Other drivers take the bus's pins, so that the HATs can be reached no more. That is no failure
/// of the HATs that are configured next.
#[test]
fn hats_do_not_inherit_the_failure_of_earlier_ones() {
    let Some(image) = firmware_image() else { return };
    let (mut chip, mut hats) = configured(&image);
    for setup in [fast_config(250.0, StepDir::A4988), hat_setup()] {
        for command in setup.commands() {
            assert_eq!(chip.request(command), None);
        }
        assert_eq!(chip.state(), State::Ready);
        hats.apply(&chip.run_us(300_000));
    }
    assert_eq!(chip.state(), State::Ready);
    assert!(!hats.are_off(), "the motors hold");
}
