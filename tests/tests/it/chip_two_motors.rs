//! The real firmware in the emulated chip, with two motors and a ball in a plane.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::path::Path;

use plumb_emulator::plant::Plant;
use plumb_protocol::boards::SKR_PICO;
use plumb_protocol::config::{Estimated, Law};
use plumb_protocol::message::{
    Command, ConfigField, DriverFault, Fault, FromBoard, Jog, Refusal, State,
};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, Steps16};
use plumb_protocol::wiring::{Coils, Drivers, MotorPins, Pin, StepDir, Tmc2209, Wiring};
use plumb_runtime::rig::LawName;
use plumb_tests::chip::{
    CYCLES_PER_US, Chip, EMERGENCY_FILTER_US, ENABLE, Pair, Setup, fast_config, firmware_image,
};
use plumb_tests::is_long;
use plumb_tests::planar::{LAWS, planar_rig, planar_task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

/// STEP and DIR of motor C on a Pico without a wiring.
const PINS_OF_C: [u8; 2] = [6, 7];

/// Returns STEP/DIR drivers, and a configuration for jogs of `count` motors.
fn setup(count: usize) -> Setup {
    let mut setup = fast_config(400.0, StepDir::TMC2209);
    setup.deadlines.host = Milliseconds(5000);
    setup.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(4000));
    if count < 3 { setup.of_two_motors() } else { setup }
}

/// Configures a board.
fn configure(chip: &mut Chip, setup: Setup) {
    for command in setup.commands() {
        assert_eq!(chip.request(command), None);
    }
}

/// Jogs a motor by full steps, to the end.
fn jog(chip: &mut Chip, motor: u8, steps: i32) {
    let rate = Rate::from_si(200.0).expect("a rate");
    let jog = Jog { motor, distance: Steps16(16 * steps), rate };
    assert_eq!(chip.request(Command::Jog(jog)), None);
    chip.run_us(50_000 + 10_000 * u64::from(steps.unsigned_abs()));
    assert_eq!(chip.state(), State::Ready);
}

/// Returns the motor positions in telemetry, full steps.
fn told(chip: &mut Chip) -> Vec<f64> {
    let telemetry = chip.status();
    assert_eq!(telemetry.rates.len(), telemetry.motors.len());
    telemetry.motors.iter().map(|position| position.to_si()).collect()
}

/// Lists the edges at these pins from now on.
fn list(chip: &mut Chip, pins: [u8; 2]) {
    chip.execute(json!({ "list": pins }));
    chip.edges.clear();
}

/// Returns the faults and refusals that the chip has reported.
fn objections(chip: &Chip) -> Vec<FromBoard> {
    let is_objection = |message: &&FromBoard| match message {
        FromBoard::Answer(answer) => answer.refusal.is_some(),
        message => matches!(message, FromBoard::Fault(_)),
    };
    chip.received.iter().filter(is_objection).copied().collect()
}

/// Drives the planar rig to its target and compares with the emulated board.
fn drive(image: &Path, law: LawName) {
    let rig = planar_rig(law);
    let wiring = rig.wiring().expect("a wiring");
    let mut chip = Chip::start_with(image, &wiring.pins);
    list(&mut chip, PINS_OF_C);
    let mut pair = Pair::new(chip, &planar_task());
    pair.request(Command::Wire(wiring));
    pair.request(Command::Configure(rig.config().expect("a configuration")));
    pair.request(Command::Target(rig.targets().expect("a target")[0]));
    let mut frames = 0;
    while pair.state() != State::Holding {
        pair.frame();
        frames += 1;
        assert!(frames < 1000, "{law}: {}", pair.state());
    }
    pair.request(Command::Stop);
    pair.run(600_000);
    pair.assert_agree(law.as_str());
    let telemetry = pair.telemetry();
    assert_eq!([telemetry.motors.len(), telemetry.rates.len()], [2; 2], "{law}");
    assert!(telemetry.motors.iter().all(|position| position.0.abs() > 16), "{telemetry:?}");
    assert_eq!((objections(&pair.chip), &pair.chip.edges[..]), (vec![], &[][..]), "{law}");
    let error = (pair.plant.ball() - planar_task().target).norm();
    assert!(error < 0.010, "{law}: {error} m");
}

#[test]
fn a_drive_in_the_plane_is_the_same_to_the_bit_with_every_law() {
    let Some(image) = firmware_image() else { return };
    LAWS.into_iter().for_each(|law| drive(&image, law));
}

#[test]
fn what_two_motors_cannot_do_is_refused() {
    let Some(image) = firmware_image() else { return };
    let (two, three) = (setup(2), setup(3));
    let mut chip = Chip::start(&image).configured(two);
    let rate = Rate::from_si(100.0).expect("a rate");
    let third = Command::Jog(Jog { motor: 2, distance: Steps16(16), rate });
    assert_eq!(chip.request(third), Some(Refusal::NoSuchMotor));
    let taut = two.with_law(Law::Taut(Estimated { delay: Milliseconds(5) }));
    let motors = ConfigField::Motors;
    for (wired, config, field) in
        [(two, *three, motors), (three, *two, motors), (two, *taut, ConfigField::Law)]
    {
        let [wire, _] = wired.commands();
        assert_eq!(chip.request(wire), None);
        assert_eq!(chip.request(Command::Configure(config)), Some(Refusal::Config(field)));
    }
    // The configuration in force is that of two motors.
    assert_eq!(chip.request(third), Some(Refusal::NoSuchMotor));
    jog(&mut chip, 1, -3);
    assert_eq!(told(&mut chip), [0.0, -3.0]);
}

#[test]
fn the_pins_of_a_third_motor_are_used_with_three_motors_only() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    list(&mut chip, PINS_OF_C);
    let mut chip = chip.configured(setup(2));
    jog(&mut chip, 0, 20);
    jog(&mut chip, 1, -30);
    assert_eq!(chip.edges, [[0; 3]; 0]);
    assert_eq!((told(&mut chip), chip.motors), (vec![20.0, -30.0], [20.0, -30.0, 0.0]));

    configure(&mut chip, setup(3));
    jog(&mut chip, 2, -5);
    jog(&mut chip, 0, 1);
    assert_eq!((told(&mut chip), chip.motors), (vec![21.0, -30.0, -5.0], [21.0, -30.0, -5.0]));
    let is_pulse = |edge: &&[u64; 3]| edge[1..] == [6, 1];
    assert_eq!(chip.edges.iter().filter(is_pulse).count(), 5 * 16);

    configure(&mut chip, setup(2));
    chip.run_us(10_000);
    chip.edges.clear();
    jog(&mut chip, 0, -7);
    jog(&mut chip, 1, 7);
    assert_eq!(chip.edges, [[0; 3]; 0]);
    assert_eq!((told(&mut chip), chip.motors), (vec![14.0, -23.0], [14.0, -23.0, -5.0]));

    // Motor C stands where it stood.
    configure(&mut chip, setup(3));
    assert_eq!(told(&mut chip), [14.0, -23.0, -5.0]);
    jog(&mut chip, 2, 2);
    assert_eq!((told(&mut chip), chip.motors), (vec![14.0, -23.0, -3.0], [14.0, -23.0, -3.0]));
    configure(&mut chip, setup(2));
    for (pin, level) in [(6, 1), (6, 0), (7, 1), (7, 0)] {
        chip.drive_pin(pin, Some(level));
        assert_eq!(chip.pin_level(pin), u64::from(level), "GP{pin} is an input");
        chip.drive_pin(pin, None);
    }
}

/// The state machine of motor C had these pins: it must let go of them.
#[test]
fn the_pins_of_a_third_motor_can_be_those_of_motor_a() {
    let Some(image) = firmware_image() else { return };
    let (two, three) = (setup(2), setup(3));
    let mut chip = Chip::start(&image).configured(three);
    jog(&mut chip, 2, 5);
    let mut wiring = Wiring::pico(two.drivers).of_motors(2);
    wiring.pins.motors[0] = MotorPins { step: Pin::new(6), direction: Pin::new(7) };
    let mut chip = chip.wired(wiring, *two);
    assert_eq!(chip.request(Command::Home), None);
    chip.count_steps_at(&wiring.pins);
    list(&mut chip, [2, 3]);
    for (motor, steps) in [(0, -4), (0, 24), (1, -30)] {
        jog(&mut chip, motor, steps);
    }
    assert_eq!(chip.edges, [[0; 3]; 0], "GP2 and GP3 turn nothing");
    assert_eq!((told(&mut chip), chip.motors), (vec![20.0, -30.0], [20.0, -30.0, 0.0]));

    configure(&mut chip, three);
    let Command::Wire(wiring) = three.commands()[0] else { panic!() };
    assert_eq!(chip.request(Command::Home), None);
    chip.count_steps_at(&wiring.pins);
    for (motor, steps) in [(0, 3), (1, 2), (2, -1)] {
        jog(&mut chip, motor, steps);
    }
    assert_eq!((told(&mut chip), chip.motors), (vec![3.0, 2.0, -1.0], [3.0, 2.0, -1.0]));
}

/// Returns a board with the first Motor HAT alone, 0.2 s after its configuration of `count` motors.
fn with_one_hat(image: &Path, count: usize) -> Chip {
    let mut chip = Chip::start(image);
    chip.execute(json!({ "i2c": [0, 0x60, "pca9685"] }));
    let drivers = Drivers::MotorHats(Coils { duty_percent: 80 });
    let mut setup = Setup { drivers, ..setup(count) };
    let rate = Rate::from_si(250.0).expect("a rate");
    setup.motors.iter_mut().for_each(|motor| motor.max_rate = rate);
    setup.jog.max_rate = rate;
    let mut chip = chip.configured(setup);
    chip.run_us(200_000);
    chip
}

#[test]
fn one_motor_hat_is_enough_for_two_motors() {
    let Some(image) = firmware_image() else { return };
    let hat = State::Fault(Fault::Driver(DriverFault::Hat));
    let mut chip = with_one_hat(&image, 3);
    assert_eq!(chip.state(), hat, "motor C has a HAT of its own");
    let mut chip = with_one_hat(&image, 2);
    jog(&mut chip, 0, 20);
    jog(&mut chip, 1, -10);
    assert_eq!((told(&mut chip), objections(&chip)), (vec![20.0, -10.0], vec![]));
    chip.execute(json!({ "i2c": [0, 0x60, null] }));
    let rate = Rate::from_si(100.0).expect("a rate");
    let on = Jog { motor: 1, distance: Steps16(16 * 20), rate };
    assert_eq!(chip.request(Command::Jog(on)), None);
    chip.run_us(100_000);
    assert_eq!(chip.state(), hat);
}

/// Returns an SKR Pico whose drivers X and Y are there, 0.4 s after its configuration of `count`
/// motors.
fn with_two_drivers(image: &Path, count: usize) -> Chip {
    let drivers = Drivers::Tmc2209(Tmc2209::of(&SKR_PICO));
    let wiring = Wiring { board: SKR_PICO.kind, pins: SKR_PICO.pins, drivers }.of_motors(count);
    let mut chip = Chip::start_with(image, &wiring.pins);
    let there = [[0, 11, 10, 12], [2, 6, 5, 7]];
    chip.execute(json!({ "tmc2209": { "uart": [8, 9], "drivers": there } }));
    let mut chip = chip.wired(wiring, *setup(count));
    chip.run_us(400_000);
    chip
}

#[test]
fn two_tmc2209_on_a_uart_are_set_up_and_watched() {
    let Some(image) = firmware_image() else { return };
    let mut chip = with_two_drivers(&image, 3);
    let silent = |motor| State::Fault(Fault::Driver(DriverFault::Silent(motor)));
    assert_eq!(chip.state(), silent(2), "motor C has a driver of its own");
    let mut chip = with_two_drivers(&image, 2);
    assert_eq!([12, 7, 2].map(|pin| chip.pin_level(pin)), [0, 0, 1], "that of C is off");
    jog(&mut chip, 0, 20);
    jog(&mut chip, 1, -30);
    assert_eq!((told(&mut chip), objections(&chip)), (vec![20.0, -30.0], vec![]));
    assert_eq!(chip.motors, [20.0, -30.0, 0.0]);
    let drivers = chip.execute(json!({ "drivers": true }))["drivers"].take();
    // DIR of X and Y is inverted.
    let of = |index: usize, name: &str| drivers[index][name].as_i64().expect(name);
    assert_eq!([0, 1].map(|index| of(index, "position")), [-20 * 256, 30 * 256]);
    assert_eq!([0, 1].map(|index| of(index, "microsteps")), [16; 2]);

    chip.execute(json!({ "driver": { "index": 1, "temperature": 130 } }));
    chip.run_us(100_000);
    let report = chip.received.iter().rev().find_map(|message| match message {
        FromBoard::Drivers(report) => Some(report.motors),
        _ => None,
    });
    assert_eq!(report.expect("readings").map(|it| it.is_hot), [false, true]);
    chip.execute(json!({ "driver": { "index": 1, "isSilent": true } }));
    chip.run_us(400_000);
    assert_eq!(chip.state(), silent(1));
}

/// Opens the emergency input at random times while two motors move.
#[test]
fn the_emergency_input_stops_two_motors_and_their_positions_stay_exact() {
    let Some(image) = firmware_image() else { return };
    // An instruction of the processor, which the chip completes first, and the monitor's clocks.
    let cut_cycles = EMERGENCY_FILTER_US * CYCLES_PER_US + 50;
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let fast = fast_config(62_500.0, StepDir::TMC2209).of_two_motors();
    let mut chip = Chip::start(&image);
    list(&mut chip, PINS_OF_C);
    let mut chip = chip.configured(fast);
    chip.drive_pin(ENABLE, Some(1));
    for round in 0..if is_long() { 200 } else { 20 } {
        let target = if round % 2 == 0 { 1_700_000 } else { -850_000 };
        chip.seek([0, 300_000, 0], [0, 100_000, target]);
        chip.run_us(random.random_range(3_000..30_000));
        chip.execute(json!({ "run_cycles": random.random_range(0..25_000) }));
        assert_eq!(chip.state(), State::Seeking, "round {round}");
        assert!(chip.pulses()[..2].iter().all(|pulses| pulses.count > 100), "round {round}");
        let opened = chip.cycle;
        chip.set_emergency(true);
        chip.execute(json!({ "run_cycles": cut_cycles }));
        assert_eq!(chip.pin_level(ENABLE), 1, "round {round}: the drivers are off");
        chip.run_us(400);
        let last = chip.pulses().iter().filter_map(|pulses| pulses.last).max().expect("pulses");
        assert!(last <= opened + cut_cycles, "round {round}: a pulse after the opening");
        assert_eq!(chip.state(), State::Fault(Fault::EmergencyStop));
        assert_eq!(told(&mut chip), chip.motors[..2], "round {round}");
        chip.set_emergency(false);
        chip.run_us(1000);
        assert_eq!(chip.request(Command::ClearFault), None);
    }
    assert_eq!(chip.edges, [[0; 3]; 0], "motor C");
}
