//! The real firmware in the emulated chip: number and timing of the pulses at the drivers' inputs.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use plumb_protocol::message::{Command, Jog};
use plumb_protocol::units::{Rate, Steps16};
use plumb_protocol::wiring::StepDir;
use plumb_tests::chip::{CYCLES_PER_US, Chip, Pulses, fast_config, firmware_image, point};
use plumb_tests::is_long;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Sends one random command: a position, a target, a stop or a jog.
fn send_random(chip: &mut Chip, random: &mut ChaCha8Rng, rate: f64) {
    let mut point_um = || [0; 3].map(|_| random.random_range(-900_000..1_900_000));
    let (ball, target) = (point_um(), point_um());
    match random.random_range(0..12) {
        0 => drop(chip.request(Command::Stop)),
        1..3 => drop(chip.request(Command::Target(point(target)))),
        3 => {
            chip.stop_and_wait();
            let distance = Steps16(random.random_range(-20_000..20_000));
            let rate = Rate::from_si(rate * random.random_range(0.01..1.0)).expect("a rate");
            let motor = random.random_range(0..3);
            assert_eq!(chip.request(Command::Jog(Jog { motor, distance, rate })), None);
            chip.run_us(40_000);
            chip.stop_and_wait();
            chip.send_position(ball);
            chip.request(Command::Target(point(target)));
        }
        4..8 => chip.send_position(ball),
        // Near the target, the rates take any value.
        _ => chip.send_position([0, 1, 2].map(|i| {
            let near: i32 = random.random_range(-3_000..3_000);
            (target[i] + near).clamp(-900_000, 1_900_000)
        })),
    }
    let us = random.random_range(0..20_000);
    chip.run_us(us);
}

/// Makes at least `steps_a_round` random steps in each of `rounds`. After each, the board's motor
/// positions are exact.
fn random_steps(driver: StepDir, rate: f64, (rounds, steps_a_round): (usize, u64), seed: u64) {
    let Some(image) = firmware_image() else { return };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut chip = Chip::start(&image).configured(fast_config(rate, driver));
    let [mut steps, mut turns] = [0, 0];
    for _ in 0..rounds {
        chip.send_position([0; 3]);
        chip.request(Command::Target(point([1_000_000; 3])));
        let end = steps + steps_a_round;
        while steps < end {
            send_random(&mut chip, &mut random, rate);
            for pulses in chip.pulses() {
                steps += pulses.count;
                turns += u64::from(pulses.hold.is_some());
                assert_timing(&pulses, &driver);
            }
        }
        let telemetry = chip.stop_and_wait();
        assert_eq!(telemetry.motors.map(Steps16::to_si), chip.motors, "after {steps} steps");
    }
    println!(
        "{steps} steps, {turns} stretches with reversals, {:.1} s of the chip",
        chip.us() as f64 * 1e-6
    );
    assert!(turns > steps / 100_000, "{turns}");
}

/// Checks that no time is below `driver`'s minimum. The direction is held for a pulse at least.
fn assert_timing(pulses: &Pulses, driver: &StepDir) {
    let minima = [driver.high, driver.low, driver.setup, driver.hold.max(driver.high)];
    let measured = [pulses.high, pulses.low, pulses.setup, pulses.hold];
    for ((measured, minimum), what) in
        measured.into_iter().zip(minima).zip(["high", "low", "set-up", "hold"])
    {
        let ns = measured.map_or(u64::MAX, |cycles| cycles * 1000 / CYCLES_PER_US);
        assert!(ns >= u64::from(minimum.0), "{what}: {ns} ns of {driver:?}");
    }
}

/// Steps of a round in the long form: ten million in both tests.
const MILLION: u64 = 1_000_000;

#[test]
fn no_step_is_lost_on_a_tmc2209() {
    let rounds = if is_long() { (5, MILLION) } else { (5, MILLION / 10) };
    random_steps(StepDir::TMC2209, 78_125.0, rounds, 1);
}

#[test]
fn no_step_is_lost_on_each_driver() {
    let steps = if is_long() { MILLION } else { MILLION / 10 };
    if is_long() {
        random_steps(StepDir::TMC2209, 78_125.0, (3, MILLION), 2);
    }
    random_steps(StepDir::A4988, 31_000.0, (1, steps), 3);
    random_steps(StepDir::DRV8825, 16_000.0, (1, steps), 4);
}

/// Pulses of 2.5 µs, DIR 5 µs before and after a pulse, up to 192 000 pulses/s. A late segment that
/// does not delay the next one is found here with 100 000 steps, and on the A4988 with a million.
#[test]
fn every_time_of_a_dm542_holds() {
    let steps = if is_long() { MILLION } else { MILLION / 10 };
    random_steps(StepDir::DM542, 12_000.0, (1, steps), 6);
}
