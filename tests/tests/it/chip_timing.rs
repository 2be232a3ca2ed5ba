//! The real firmware in the emulated chip: every tick is planned in time, for any input.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeSet;

use plumb_protocol::config::{Law, Sign};
use plumb_protocol::message::{Command, Fault, Hello, Jog, State};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, SignGain, Steps16};
use plumb_protocol::wiring::{Coils, Drivers, StepDir};
use plumb_tests::chip::reach::reached_in_flash;
use plumb_tests::chip::{
    BALL_UM, Chip, FAR_TARGET_UM, REVERSING_BALL_UM, Setup, fast_config, firmware_image, point,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Exception number of TIMER_IRQ_1, the stepping interrupt.
const STEPPING: u8 = 17;
/// Duration of a tick, cycles.
const TICK: u64 = 25_000;

/// Returns step and direction at 1 M steps/s without and with a moving average, the latter also
/// with law `sign`; and coils.
fn configs() -> [Setup; 4] {
    let quick = fast_config(62_500.0, StepDir::TMC2209);
    let mut mean = quick;
    mean.mean = Milliseconds(320);
    let mut coils = fast_config(2_400.0, StepDir::TMC2209);
    coils.drivers = Drivers::Coils(Coils { duty_percent: 80 });
    coils.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(100_000));
    let signs = mean.with_law(Law::Sign(Sign { gain: SignGain(1 << 20) }));
    [quick, mean, signs, coils]
}

/// Returns the spread of the ticks' phases within the 25 000 cycles. The first is in the middle.
fn phase_spread(reply: &Value) -> u64 {
    let ticks = reply["calls"]["tick"].as_array().expect("calls");
    let began: Vec<u64> = ticks.iter().filter_map(|tick| tick[0].as_u64()).collect();
    let phases: BTreeSet<u64> = began.iter().map(|at| (at + TICK / 2 - began[0]) % TICK).collect();
    assert!(ticks.len() > 500, "{}", ticks.len());
    phases.last().expect("ticks") - phases.first().expect("ticks")
}

/// A function in flash may cost a hundred clocks a line of the cache where the chip has to read it
/// first. Wakers are called through a table of pointers.
#[test]
fn a_tick_runs_no_code_in_flash() {
    let Some(image) = firmware_image() else { return };
    let wakers = ["_ZN16embassy_executor3raw5waker"];
    let reached = reached_in_flash(&image, "TIMER_IRQ_1", &wakers);
    assert!(reached.is_empty(), "{} functions:\n{}", reached.len(), reached.join("\n"));
}

/// The processor reads the vectors of interrupts from memory, not from flash.
#[test]
fn the_vectors_are_in_memory() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let vectors = chip.execute(json!({ "vectors": true }))["vectors"].as_u64().expect("a place");
    assert!((0x2000_0000..0x2004_2000).contains(&vectors), "{vectors:#x}");
}

/// Clocks by which the interrupt may come late: `AHEAD_US` (60 µs, firmware/src/stepping.rs)
/// without the longest planning, and without the 4.5 µs in which the state machines get their
/// words.
const SPARE: u64 = 60 * 125 - 5852 - 562;
/// The same with questions back to back on the UART, where interrupts are off while the links'
/// tasks take bytes from their queues.
const SPARE_OF_UART: u64 = 700;

/// A tick that is planned too late is executed late, and so are all that follow: the phase of the
/// stepping interrupt changes.
#[test]
fn no_tick_is_late_for_any_input() {
    let Some(image) = firmware_image() else { return };
    for config in configs() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut chip = Chip::start(&image).configured(config);
        chip.seek(BALL_UM, FAR_TARGET_UM);
        chip.run_us(30_000);
        chip.execute(json!({ "trace": { "handlers": { "tick": STEPPING } } }));
        for round in 0..40 {
            chip.send_position(if round % 2 == 0 { REVERSING_BALL_UM } else { BALL_UM });
            match round % 8 {
                3 => drop(chip.request(Command::Target(point(FAR_TARGET_UM)))),
                4 => drop(chip.request(Command::Configure(config.config))),
                5 => {
                    let noise: Vec<u8> =
                        (0..250).map(|_| random.random_range(1..=255)).chain([0]).collect();
                    chip.send(&noise, 2_000);
                }
                6 => drop(chip.request(Command::Status)),
                _ => {}
            }
            let us = random.random_range(0..2_000);
            chip.run_us(us);
        }
        let reply = chip.execute(json!({ "calls": true }));
        // A critical section delays the interrupt by some cycles, more where it waits for flash.
        assert!(
            phase_spread(&reply) < SPARE,
            "{:?}: phase spread {} cycles",
            config.drivers,
            phase_spread(&reply)
        );
        assert_eq!(chip.counter(&image, "LATE_TICKS"), 0, "{:?}", config.drivers);
        assert!(chip.pulses().iter().all(|pulses| pulses.count > 10), "it has moved");
    }
}

/// Stalls the processor for one tick and a half from the middle between two calls of the stepping
/// interrupt: one tick is late. A stall in the middle of a call may make two late.
fn stall(chip: &mut Chip) {
    chip.execute(json!({ "trace": { "handlers": { "tick": STEPPING } } }));
    chip.run_us(1000);
    let reply = chip.execute(json!({ "calls": true }));
    chip.execute(json!({ "trace": null }));
    let last = reply["calls"]["tick"].as_array().and_then(|calls| calls.last()).expect("a call");
    let passed = chip.cycle - last[0].as_u64().expect("a cycle");
    chip.execute(json!({ "run_cycles": (3 * TICK / 2 - passed) % TICK }));
    chip.execute(json!({ "stall": TICK * 3 / 2 }));
}

/// Stores the configuration at rest, then delays the processor while motors turn: the firmware
/// counts each kind of late tick for itself.
#[test]
fn late_ticks_are_counted_while_motors_turn_and_at_rest() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image).configured(fast_config(312.5, StepDir::TMC2209));
    let counts =
        |chip: &mut Chip| ["LATE_TICKS", "LATE_AT_REST"].map(|name| chip.counter(&image, name));
    let [moving, started] = counts(&mut chip);
    assert_eq!(moving, 0);
    let frame = chip.frame(Command::Store);
    chip.send(&frame, 100_000);
    let [moving, stored] = counts(&mut chip);
    assert_eq!(moving, 0);
    // The sector is erased, and two pages are written.
    assert!((1..5).contains(&(stored - started)), "{} late ticks", stored - started);
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(20_000);
    assert_eq!(counts(&mut chip), [0, stored]);
    for late in 1..=3 {
        stall(&mut chip);
        chip.run_us(5_000);
        assert_eq!(counts(&mut chip), [late, stored]);
    }
    assert_eq!(chip.status().late_ticks, 3);
}

/// A tick in twenty is late, as beside a processor that has too much to do.
#[test]
fn many_late_ticks_stop_the_board() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image).configured(fast_config(312.5, StepDir::TMC2209));
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(20_000);
    for late in 1..=11 {
        assert!(matches!(chip.state(), State::Seeking), "before late tick {late}");
        stall(&mut chip);
        chip.send_position(BALL_UM);
    }
    let telemetry = chip.status();
    assert_eq!(telemetry.state, State::Fault(Fault::LateTicks));
    assert_eq!(telemetry.late_ticks, 11);
}

/// Asks for the state back to back on the UART, for 0.3 s of a jog.
#[test]
fn no_tick_is_late_beside_questions_on_the_uart() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image).configured(fast_config(312.5, StepDir::TMC2209));
    chip.run_us(1_100_000);
    // USB has been silent for a second: the UART may become the master.
    let jog = Jog { motor: 0, distance: Steps16(4_800), rate: Rate(300 << 8) };
    let mut frames = chip.frame(Command::Hello(Hello::OURS));
    frames.extend(chip.frame(Command::Jog(jog)));
    (0..430).for_each(|_| frames.extend(chip.frame(Command::Status)));
    let hex: String = frames.iter().map(|byte| format!("{byte:02x}")).collect();
    chip.execute(json!({ "uart": hex }));
    chip.run_us(20_000);
    chip.execute(json!({ "trace": { "handlers": { "tick": STEPPING } } }));
    chip.run_us(300_000);
    let spread = phase_spread(&chip.execute(json!({ "calls": true })));
    assert!(spread < SPARE_OF_UART, "phase spread {spread} cycles");
    assert_eq!(chip.counter(&image, "LATE_TICKS"), 0);
    assert!(chip.motors[0] > 70.0, "it has moved: {:?}", chip.motors);
    // Each answer has 50 bytes and more, each question 9: the line is too slow for all answers.
    assert!(chip.counter(&image, "DROPPED_FRAMES") > 100, "they are counted");
}

/// Turns the motors for 20 s with positions, questions and telemetry on USB. `make bench-chip
/// ARGS="--seconds 600"` does it for ten minutes.
#[test]
fn no_tick_is_late_beside_the_traffic_on_usb() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image).configured(fast_config(312.5, StepDir::TMC2209));
    let before = chip.counter(&image, "LATE_AT_REST");
    chip.turn_beside_traffic(20);
    assert_eq!(chip.counter(&image, "LATE_TICKS"), 0);
    assert_eq!(chip.counter(&image, "LATE_AT_REST"), before);
}

/// Close to the end of the travel, each tick of a jog computes the stopping distance.
#[test]
fn no_tick_is_late_before_the_end_of_the_travel() {
    let Some(image) = firmware_image() else { return };
    for mean in [0, 320] {
        let mut config = fast_config(62_500.0, StepDir::TMC2209);
        config.mean = Milliseconds(mean);
        config.motors.iter_mut().for_each(|motor| motor.travel_max = Steps16(60_000));
        let mut chip = Chip::start(&image).configured(config);
        chip.run_us(10_000);
        chip.execute(json!({ "trace": { "handlers": { "tick": STEPPING } } }));
        for motor in 0..3 {
            let rate = Rate::from_si(62_000.0).expect("a rate");
            assert_eq!(
                chip.request(Command::Jog(Jog { motor, distance: Steps16(60_000), rate })),
                None
            );
            chip.run_us(100_000 + 1000 * u64::from(mean));
        }
        let reply = chip.execute(json!({ "calls": true }));
        assert!(
            phase_spread(&reply) < 400,
            "{mean} ms: phase spread {} cycles",
            phase_spread(&reply)
        );
        assert_eq!(chip.motors, [3750.0; 3]);
    }
}
