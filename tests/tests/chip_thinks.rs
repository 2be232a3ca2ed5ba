//! The real image in the emulated chip: a law that thinks for longer than a tick, and what must not
//! wait for it.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use object::{Object, ObjectSymbol};
use plumb_protocol::Config;
use plumb_protocol::config::{Coils, Drivers, Estimated, Law, StepDir};
use plumb_protocol::message::{Fault, FromBoard, State};
use plumb_protocol::units::{Milliseconds, Steps16};
use plumb_tests::chip::{
    BALL_UM, CYCLES_PER_US, Chip, ENABLE, FAR_TARGET_UM, fast_config, firmware_image,
};
use serde_json::json;

/// A tick, cycles.
const TICK: u64 = 25_000;
/// The stepping interrupt: TIMER_IRQ_1.
const STEPPING: u8 = 17;

/// The slow laws.
fn laws() -> [Law; 2] {
    let estimated = Estimated { delay: Milliseconds(0) };
    [Law::Adaptive(estimated), Law::Taut(estimated)]
}

/// How late each tick's interrupt came, cycles: by how much it is behind the first one.
fn lateness(calls: &serde_json::Value) -> Vec<u64> {
    let began: Vec<u64> =
        calls.as_array().expect("calls").iter().filter_map(|call| call[0].as_u64()).collect();
    // The first may have waited some cycles for others to be let in.
    began
        .iter()
        .map(|at| (at + TICK / 2 - began[0]) % TICK)
        .map(|phase| phase.saturating_sub(TICK / 2))
        .collect()
}

/// While the law thinks, the links are full of noise and the motors turn at 3 x 1 M steps/s: every
/// tick comes in its time, and no motor pauses.
#[test]
fn no_tick_is_late_while_a_slow_law_thinks() {
    let Some(image) = firmware_image() else { return };
    for law in laws() {
        let mut chip = Chip::start(&image)
            .configured(Config { law, ..fast_config(62_500.0, StepDir::TMC2209) });
        chip.seek(BALL_UM, FAR_TARGET_UM);
        chip.execute(json!({ "trace": { "functions": {}, "handlers": { "tick": STEPPING } } }));
        for at in 0..15 {
            chip.send_position([BALL_UM[0] + 3000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
            for _ in 0..5 {
                // Frames that are none, of 60 bytes.
                chip.send(&[[at as u8 + 1; 59].as_slice(), &[0]].concat(), 6_000);
            }
            chip.pulses();
        }
        // 480 ms were 2400 ticks or one less, as the first one fell.
        chip.run_us(200);
        let ticks = chip.execute(json!({ "calls": true }))["calls"]["tick"].take();
        let late = lateness(&ticks);
        assert!(late.len() >= 2400, "{} ticks", late.len());
        // What was late once would move all that follow; single ones wait for interrupts to be let
        // in again.
        let at_the_end = late[late.len() - 100..].iter().min().expect("ticks");
        assert!(*at_the_end < CYCLES_PER_US, "{law:?}: {at_the_end} cycles late");
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

/// Where the function is in which slow laws think.
fn answer(image: &Path) -> u64 {
    let elf = std::fs::read(image).expect("an image that can be read");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let name = |name: &str| {
        name.starts_with("_ZN") && name.contains("think") && name.contains("Thinker6answer")
    };
    let found = file.symbols().find(|symbol| symbol.name().is_ok_and(name));
    found.expect("the thinker's function").address() & !1
}

/// Thread mode hangs in a thought, and all else goes on: the motors ramp down when the answer is
/// due, and the watchdog bites.
#[test]
fn a_thought_that_never_ends_stops_the_motors_and_then_the_board() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image)
        .configured(Config { law: laws()[0], ..fast_config(400.0, StepDir::TMC2209) });
    chip.drive_pin(ENABLE, Some(1));
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(30_000);
    chip.send_position(BALL_UM);
    chip.run_us(30_000);
    assert!(chip.pulses().iter().any(|pulses| pulses.count > 100));
    // A jump to itself.
    chip.execute(json!({ "poke": [answer(&image), "fee7"] }));
    chip.send_position(BALL_UM);
    chip.run_us(5_000);
    let told =
        |m: &FromBoard| matches!(m, FromBoard::Fault(report) if report.fault == Fault::LawLate);
    assert!(chip.received.iter().any(told), "{:?}", chip.received.last());
    chip.pulses();
    chip.run_us(20_000);
    assert_eq!(chip.pulses().map(|pulses| pulses.count), [0; 3]);
    chip.assert_watchdog_reset_within(250);
    chip.assert_stopped_by_watchdog();
}

/// Motor HATs keep their bus busy all the time: the answers are there in time nevertheless.
#[test]
fn a_law_has_time_to_think_while_motor_hats_turn() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    chip.execute(json!({ "i2c": [0, 0x60, "pca9685"] }));
    chip.execute(json!({ "i2c": [0, 0x61, "pca9685"] }));
    let drivers = Drivers::MotorHats(Coils { duty_percent: 80 });
    let mut chip =
        chip.configured(Config { law: laws()[1], drivers, ..fast_config(250.0, StepDir::TMC2209) });
    chip.seek(BALL_UM, FAR_TARGET_UM);
    let mut writes = 0;
    for at in 0..20 {
        let frame = chip.position_frame([BALL_UM[0] + 3000 * at, BALL_UM[1] - 700 * at, 1300 * at]);
        let reply = chip.send(&frame, 33_333);
        writes += reply["i2c"].as_array().map_or(0, Vec::len);
    }
    assert!(writes > 1000, "{writes}: the HATs are told all the time");
    assert_eq!(chip.state(), State::Seeking);
}
