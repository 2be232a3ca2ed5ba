//! The real firmware in the emulated chip: a deferred law takes longer than a tick and delays
//! nothing else.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use nalgebra::{Point3, Vector3};
use object::{Object, ObjectSymbol};
use plumb_path::trajectory::Moment;
use plumb_protocol::config::{Estimated, Law};
use plumb_protocol::message::{Command, Fault, FromBoard, State};
use plumb_protocol::units::{Milliseconds, Steps16};
use plumb_protocol::wiring::{Coils, Drivers, StepDir};
use plumb_runtime::reference::reference;
use plumb_tests::chip::{
    BALL_UM, CYCLES_PER_US, Chip, ENABLE, FAR_TARGET_UM, Setup, fast_config, firmware_image,
};
use serde_json::json;

/// Duration of a tick, cycles.
const TICK: u64 = 25_000;
/// Exception number of TIMER_IRQ_1, the stepping interrupt.
const STEPPING: u8 = 17;

/// Returns the deferred laws.
fn laws() -> [Law; 2] {
    let estimated = Estimated { delay: Milliseconds(0) };
    [Law::Adaptive(estimated), Law::Taut(estimated)]
}

/// Returns the lateness of each tick's interrupt relative to the first, cycles.
fn lateness(calls: &serde_json::Value) -> Vec<u64> {
    let began: Vec<u64> =
        calls.as_array().expect("calls").iter().filter_map(|call| call[0].as_u64()).collect();
    // The first may be some cycles late, if interrupts were off.
    began
        .iter()
        .map(|at| (at + TICK / 2 - began[0]) % TICK)
        .map(|phase| phase.saturating_sub(TICK / 2))
        .collect()
}

/// Checks that the traced ticks were on time at the end. A late tick delays all that follow; a
/// single interrupt may wait while interrupts are off. Returns the lateness of each tick, cycles.
fn assert_on_time(chip: &mut Chip, law: Law) -> Vec<u64> {
    let ticks = chip.execute(json!({ "calls": true }))["calls"]["tick"].take();
    let late = lateness(&ticks);
    let at_the_end = late[late.len() - 100..].iter().min().expect("ticks");
    assert!(*at_the_end < CYCLES_PER_US, "{law:?}: {at_the_end} cycles late");
    late
}

/// With noise on the link and 3 x 1 M steps/s, every tick is on time while a law computes, and no
/// motor pauses.
#[test]
fn no_tick_is_late_while_a_deferred_law_computes() {
    let Some(image) = firmware_image() else { return };
    for law in laws() {
        let mut chip =
            Chip::start(&image).configured(fast_config(62_500.0, StepDir::TMC2209).with_law(law));
        chip.seek(BALL_UM, FAR_TARGET_UM);
        chip.execute(json!({ "trace": { "handlers": { "tick": STEPPING } } }));
        for at in 0..15 {
            chip.send_position([BALL_UM[0] + 3000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
            for _ in 0..5 {
                // Invalid frames of 60 bytes.
                chip.send(&[[at as u8 + 1; 59].as_slice(), &[0]].concat(), 6_000);
            }
            chip.pulses();
        }
        // 480 ms are 2400 ticks or one less, depending on the first.
        chip.run_us(200);
        let late = assert_on_time(&mut chip, law);
        assert!(late.len() >= 2400, "{} ticks", late.len());
        assert!(
            late.iter().all(|late| *late < 20 * CYCLES_PER_US),
            "{law:?}: {:?} cycles",
            late.iter().max()
        );
        let telemetry = chip.stop_and_wait();
        assert_eq!(telemetry.motors.map(Steps16::to_si), chip.motors, "{law:?}");
        assert!(telemetry.bad_frames >= 75 && telemetry.sequence == Some(17), "{telemetry:?}");
    }
}

/// Along a path every tick is on time: those that make states of the reference have no other work.
#[test]
fn no_tick_is_late_along_a_path() {
    let Some(image) = firmware_image() else { return };
    let start = Point3::from(BALL_UM.map(|p| f64::from(p) * 1e-6));
    let line = |time: f64| Moment {
        position: start + Vector3::x() * 0.05 * time,
        velocity: Vector3::x() * 0.05,
        acceleration: Vector3::zeros(),
    };
    for law in laws() {
        let mut chip =
            Chip::start(&image).configured(fast_config(1000.0, StepDir::TMC2209).with_law(law));
        chip.send_position(BALL_UM);
        chip.execute(json!({ "trace": { "handlers": { "tick": STEPPING } } }));
        for k in 0..30 {
            let time = f64::from(k) / 30.0;
            let message = reference(k as u16, false, time, time, line);
            assert_eq!(chip.request(Command::Follow(message)), None);
            chip.send_position([BALL_UM[0] + 1667 * k, BALL_UM[1] + 700 * (k % 3), BALL_UM[2]]);
            chip.run_us(29_333 + 29 * (k % 7) as u64);
        }
        assert_on_time(&mut chip, law);
        let telemetry = chip.status();
        assert_eq!(telemetry.state, State::Following, "{law:?}");
        assert!(telemetry.motors != [Steps16(0); 3], "{telemetry:?}");
    }
}

/// Returns the address of the law worker's function.
fn law_worker_address(image: &Path) -> u64 {
    let elf = std::fs::read(image).expect("an image that can be read");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let name = |name: &str| {
        name.starts_with("_ZN") && name.contains("law_worker") && name.contains("LawWorker7respond")
    };
    let found = file.symbols().find(|symbol| symbol.name().is_ok_and(name));
    found.expect("the law worker's function").address() & !1
}

/// Hangs the law worker in thread mode: the motors ramp down when the response is due, and the
/// watchdog resets the board.
#[test]
fn a_law_that_hangs_stops_the_motors_and_then_resets_the_board() {
    let Some(image) = firmware_image() else { return };
    let mut chip =
        Chip::start(&image).configured(fast_config(400.0, StepDir::TMC2209).with_law(laws()[0]));
    chip.drive_pin(ENABLE, Some(1));
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(30_000);
    chip.send_position(BALL_UM);
    chip.run_us(30_000);
    assert!(chip.pulses().iter().any(|pulses| pulses.count > 100));
    // A jump to itself.
    chip.execute(json!({ "poke": [law_worker_address(&image), "fee7"] }));
    chip.send_position(BALL_UM);
    chip.run_us(5_000);
    let is_late =
        |m: &FromBoard| matches!(m, FromBoard::Fault(report) if report.fault == Fault::LawLate);
    assert!(chip.received.iter().any(is_late), "{:?}", chip.received.last());
    chip.pulses();
    chip.run_us(20_000);
    assert_eq!(chip.pulses().map(|pulses| pulses.count), [0; 3]);
    chip.assert_watchdog_reset_within(250);
    chip.assert_stopped_by_watchdog();
}

/// Motor HATs keep their bus busy. The law's responses are on time.
#[test]
fn a_deferred_law_is_on_time_with_motor_hats() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    chip.execute(json!({ "i2c": [0, 0x60, "pca9685"] }));
    chip.execute(json!({ "i2c": [0, 0x61, "pca9685"] }));
    let drivers = Drivers::MotorHats(Coils { duty_percent: 80 });
    let mut chip = chip
        .configured(Setup { drivers, ..fast_config(250.0, StepDir::TMC2209).with_law(laws()[1]) });
    chip.seek(BALL_UM, FAR_TARGET_UM);
    let mut writes = 0;
    for at in 0..20 {
        let frame = chip.position_frame([BALL_UM[0] + 3000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
        let reply = chip.send(&frame, 33_333);
        writes += reply["i2c"].as_array().map_or(0, Vec::len);
    }
    assert!(writes > 1000, "{writes} writes to the HATs");
    assert_eq!(chip.state(), State::Seeking);
}
