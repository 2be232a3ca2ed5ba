//! The real firmware in the emulated chip: a USB controller that hangs (erratum E15).

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use plumb_protocol::message::{Command, Hello, Jog, State};
use plumb_protocol::units::{Rate, Steps16};
use plumb_protocol::wiring::StepDir;
use plumb_tests::chip::{Chip, fast_config, firmware_image};
use serde_json::{Value, json};

/// Time in which the board is back on the bus after its controller has hung, at rest, µs: 100 ms
/// without the end of a transfer, and what the host takes.
const BACK_US: u64 = 300_000;

/// Returns a configured board, at rest.
fn board(image: &Path) -> Chip {
    Chip::start(image).configured(fast_config(400.0, StepDir::A4988))
}

/// Sends a question, without waiting for its answer. Returns the reply after `us` µs.
fn ask(chip: &mut Chip, us: u64) -> Value {
    let frame = chip.frame(Command::Status);
    chip.send(&frame, us)
}

/// Returns the changes of the port that the host has seen.
fn states(reply: &Value) -> Vec<&str> {
    let states = reply["states"].as_array().into_iter().flatten();
    states.filter_map(|state| state[1].as_str()).collect()
}

#[test]
fn a_hanging_usb_controller_is_reset_at_rest() {
    let Some(image) = firmware_image() else { return };
    for how in ["in", "deaf"] {
        let mut chip = board(&image);
        chip.run_us(500_000);
        assert_eq!(chip.counter(&image, "USB_RESETS"), 0, "{how}: silence is no fault");
        for resets in 1..=2 {
            // The offered data stays offered: the controller hangs after it has taken the question.
            let frame = chip.frame(Command::Status);
            chip.send(&frame, 60);
            chip.execute(json!({ "hang_usb": how }));
            // The host asks again, since no answer comes.
            chip.run_us(50_000);
            let reply = ask(&mut chip, BACK_US);
            assert_eq!(states(&reply), ["lost", "attached", "ready"], "{how}: {reply}");
            assert_eq!(chip.counter(&image, "USB_RESETS"), resets);
            assert_eq!(chip.request(Command::Hello(Hello::OURS)), None, "{how}");
            assert!(matches!(chip.state(), State::Ready | State::Fault(_)));
        }
    }
}

#[test]
fn a_hanging_usb_controller_is_not_reset_while_motors_turn() {
    let Some(image) = firmware_image() else { return };
    let mut chip = board(&image);
    let rate = Rate::from_si(10.0).expect("a rate");
    let jog = Jog { motor: 0, distance: Steps16(16 * 1000), rate };
    assert_eq!(chip.request(Command::Jog(jog)), None);
    chip.execute(json!({ "hang_usb": "in" }));
    for _ in 0..40 {
        // The host's bytes still arrive, so that the board's deadlines are kept.
        let reply = ask(&mut chip, 20_000);
        assert_eq!(states(&reply), [""; 0], "the motor turns");
    }
    assert_eq!(chip.counter(&image, "USB_RESETS"), 0);
    let stop = chip.frame(Command::Stop);
    let reply = chip.send(&stop, BACK_US);
    assert_eq!(states(&reply), ["lost", "attached", "ready"], "{reply}");
    assert_eq!(chip.counter(&image, "USB_RESETS"), 1);
    assert_eq!(chip.request(Command::Hello(Hello::OURS)), None);
}

/// Data stays offered too where no program has the port open, and where there is no host.
#[test]
fn a_closed_port_and_an_unplugged_cable_are_no_hanging_controller() {
    let Some(image) = firmware_image() else { return };
    let mut chip = board(&image);
    ask(&mut chip, 60);
    chip.execute(json!({ "dtr": false }));
    chip.run_us(1_000_000);
    assert_eq!(chip.counter(&image, "USB_RESETS"), 0, "a closed port");
    chip.execute(json!({ "dtr": true }));
    chip.run_us(10_000);
    assert_eq!(chip.request(Command::Hello(Hello::OURS)), None);
    ask(&mut chip, 60);
    chip.execute(json!({ "unplug": true }));
    chip.run_us(1_000_000);
    assert_eq!(chip.counter(&image, "USB_RESETS"), 0, "an unplugged cable");
    chip.execute(json!({ "plug": true }));
    chip.wait_for_usb();
    assert_eq!(chip.request(Command::Hello(Hello::OURS)), None);
}

/// A program that does not run, such as one stopped by SIGSTOP, takes no data and sends none. The
/// host's frames go on.
#[test]
fn a_paused_host_is_no_hanging_controller() {
    let Some(image) = firmware_image() else { return };
    let mut chip = board(&image);
    ask(&mut chip, 60);
    chip.execute(json!({ "pause_usb": true }));
    let reply = chip.run_us(2_000_000);
    assert_eq!(states(&reply), [""; 0], "{reply}");
    assert_eq!(chip.counter(&image, "USB_RESETS"), 0);
    chip.execute(json!({ "pause_usb": false }));
    assert_eq!(chip.request(Command::Hello(Hello::OURS)), None, "the same port answers");
}
