//! The real firmware in the emulated chip: emergency stop, silent host, watchdog, stack.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::Path;

use object::{Object, ObjectSymbol};
use plumb_image::chip::RP2040;
use plumb_image::{Image, PanicPlace, panic_places};
use plumb_protocol::config::{Estimated, Law};
use plumb_protocol::message::{Command, Fault, FromBoard, Hello, Jog, Refusal, StartCause, State};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, Steps16};
use plumb_protocol::wiring::StepDir;
use plumb_tests::chip::{
    BALL_UM, CYCLES_PER_US, Chip, EMERGENCY_FILTER_US, ENABLE, FAR_TARGET_UM, fast_config,
    firmware_image,
};
use plumb_tests::is_long;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Size of the stack, bytes: `STACK_SIZE` in firmware/memory-rp2040.x.
const STACK: usize = 32 * 1024;
/// Where the tests put code: near the end of memory, where nothing of the program is.
const CODE: u32 = 0x2004_1f00;

const EMERGENCY_STOP: State = State::Fault(Fault::EmergencyStop);

/// Cycles of the filter, of the monitor (9), and of an instruction of the processor, which the chip
/// completes before the input opens.
const CUT_CYCLES: u64 = EMERGENCY_FILTER_US * CYCLES_PER_US + 50;

/// Opens and closes the emergency input in turn, `count` times each, for a random time: `open_for`
/// cycles at most, `closed_for` at most.
fn bounce(chip: &mut Chip, random: &mut ChaCha8Rng, count: u32, [open_for, closed_for]: [u64; 2]) {
    for _ in 0..count {
        for (open, most) in [(true, open_for), (false, closed_for)] {
            chip.set_emergency(open);
            // The chip completes an instruction, so that shorter ones may have no cycle.
            let cycles = random.random_range(20..=most);
            chip.execute(json!({ "run_cycles": cycles }));
        }
    }
}

/// Opens the emergency input at random times while three motors move. The contact bounces at the
/// opening and at the closing; before that, shorter openings come and change nothing.
#[test]
fn the_emergency_input_cuts_the_pulses_and_the_positions_stay_exact() {
    let Some(image) = firmware_image() else { return };
    let (rounds, seed) = if is_long() { (500, 11) } else { (20, 5) };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut chip = Chip::start(&image).configured(fast_config(62_500.0, StepDir::TMC2209));
    // The pull-up resistor of the enable line.
    chip.drive_pin(ENABLE, Some(1));
    let filter = EMERGENCY_FILTER_US * CYCLES_PER_US;
    for round in 0..rounds {
        let target = if round % 2 == 0 { FAR_TARGET_UM } else { FAR_TARGET_UM.map(|x| -x / 2) };
        chip.seek(BALL_UM, target);
        let us = random.random_range(3_000..30_000);
        chip.run_us(us);
        chip.execute(json!({ "run_cycles": random.random_range(0..25_000) }));
        // All within 200 µs, so that no two ticks find the input open.
        let spikes = random.random_range(0..3);
        bounce(&mut chip, &mut random, spikes, [filter / 10, filter]);
        bounce(&mut chip, &mut random, 1, [filter - 20, filter]);
        chip.run_us(400);
        assert_eq!(chip.pin_level(ENABLE), 0, "round {round}: a spike stops nothing");
        assert!(chip.pulses().iter().any(|pulses| pulses.count > 100));
        assert_eq!(chip.state(), State::Seeking, "round {round}: a spike stops nothing");

        let bounces = random.random_range(0..6);
        bounce(&mut chip, &mut random, bounces, [2 * filter, filter]);
        let opened = chip.cycle;
        chip.set_emergency(true);
        chip.execute(json!({ "run_cycles": CUT_CYCLES }));
        assert_eq!(chip.pin_level(ENABLE), 1, "round {round}: the drivers are off");
        chip.run_us(400);
        let last = chip.pulses().iter().filter_map(|pulses| pulses.last).max().expect("pulses");
        let late = last.saturating_sub(opened);
        assert!(late <= CUT_CYCLES, "round {round}: a pulse {late} clocks after the opening");
        let telemetry = chip.status();
        assert_eq!(telemetry.state, EMERGENCY_STOP);
        assert_eq!(telemetry.motors.map(Steps16::to_si), chip.motors, "round {round}");

        assert_eq!(chip.request(Command::ClearFault), Some(Refusal::Faulted(Fault::EmergencyStop)));
        let bounces = random.random_range(0..6);
        bounce(&mut chip, &mut random, bounces, [2 * filter, 4 * filter]);
        chip.set_emergency(false);
        chip.run_us(1000);
        assert_eq!(chip.state(), EMERGENCY_STOP, "closing the loop does not clear the fault");
        assert_eq!(chip.request(Command::ClearFault), None);
    }
}

/// Opens the emergency input while the flash is erased, when the processor runs no code.
#[test]
fn an_emergency_switches_the_drivers_off_while_the_configuration_is_stored() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image).configured(fast_config(400.0, StepDir::A4988));
    chip.drive_pin(ENABLE, Some(1));
    let frame = chip.frame(Command::Store);
    chip.send(&frame, 20_000);
    assert_eq!(chip.pin_level(ENABLE), 0, "the motors have current");
    chip.set_emergency(true);
    chip.run_us(EMERGENCY_FILTER_US + 1);
    assert_eq!(chip.pin_level(ENABLE), 1, "the drivers are off within the filter's time");
    chip.run_us(100_000);
    assert_eq!(chip.state(), EMERGENCY_STOP);
    chip.set_emergency(false);
    chip.run_us(1000);
    assert_eq!(chip.request(Command::ClearFault), None);
    assert_eq!(chip.state(), State::Ready);
    assert_eq!(chip.pin_level(ENABLE), 0, "the motors have current again");
}

#[test]
fn a_silent_host_stops_the_motors_within_its_deadline_and_their_ramp() {
    let Some(image) = firmware_image() else { return };
    let (deadline_us, ramp_us) = (150_000, 250_000);
    let mut config = fast_config(1000.0, StepDir::TMC2209);
    config.motors.iter_mut().for_each(|motor| motor.max_acceleration = Acceleration(4000));
    config.deadlines.host = Milliseconds(150);
    let mut chip = Chip::start(&image).configured(config);
    let jog =
        Jog { motor: 1, distance: Steps16(1 << 20), rate: Rate::from_si(1000.0).expect("a rate") };
    assert_eq!(chip.request(Command::Jog(jog)), None);
    for _ in 0..4 {
        chip.run_us(100_000);
        assert_eq!(chip.state(), State::Jogging);
    }
    // The answer to the last Status came within 2 ms of it.
    let received = chip.us() - 2000;
    chip.run_us(1_000_000);
    let stopped = chip.pulses()[1].last.expect("pulses") / CYCLES_PER_US - received;
    assert!(
        stopped > deadline_us + ramp_us / 2,
        "{stopped} µs: it stops by a ramp, after the deadline"
    );
    assert!(stopped <= deadline_us + ramp_us + 2000, "{stopped} µs");
    assert_eq!(chip.state(), State::Fault(Fault::HostSilent));
    assert_eq!(chip.status().motors.map(Steps16::to_si), chip.motors);
}

/// Hangs the processor while the motors move: the pulses end with the buffered words, the drivers
/// are disabled, and the board reports the fault.
#[test]
fn the_watchdog_stops_moving_motors() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image).configured(fast_config(62_500.0, StepDir::TMC2209));
    chip.drive_pin(ENABLE, Some(1));
    chip.seek(BALL_UM, FAR_TARGET_UM);
    chip.run_us(10_000);
    let hung = chip.cycle;
    chip.hang();
    chip.assert_watchdog_reset_within(150);
    let last = chip.pulses().iter().filter_map(|pulses| pulses.last).max().expect("pulses");
    assert!(
        last < hung + 2 * 200 * CYCLES_PER_US,
        "{} clocks after the processor hung",
        last - hung
    );
    chip.assert_stopped_by_watchdog();
}

/// Measures the maximum stack use from power-on, by the pattern that the firmware fills it with:
/// with the emergency loop open and closed, with each law, and with a Store. The firmware finds the
/// same.
#[test]
fn a_third_of_the_stack_stays_free() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    chip.execute(json!({ "reset": "power" }));
    chip.set_emergency(true);
    chip.wait_for_usb();
    chip.set_emergency(false);
    chip.run_us(1000);
    chip.request(Command::Hello(Hello::OURS));
    assert_eq!(chip.request(Command::ClearFault), None);
    let delay = Milliseconds(40);
    let estimated = Estimated { delay };
    for law in
        [Law::Adaptive(estimated), Law::Taut(estimated), fast_config(400.0, StepDir::A4988).law]
    {
        for command in fast_config(400.0, StepDir::A4988).with_law(law).commands() {
            assert_eq!(chip.request(command), None);
        }
        chip.seek(BALL_UM, FAR_TARGET_UM);
        for z in 0..5 {
            chip.send_position([500_000, 300_000, 3_000 * z]);
            chip.run_us(30_000);
        }
        chip.stop_and_wait();
    }
    let frame = chip.frame(Command::Store);
    chip.send(&frame, 100_000);
    let stack = chip.execute(json!({ "peek": [0x2000_0000, STACK] }))["peek"].to_string();
    let free =
        stack.trim_matches('"').as_bytes().chunks(2).take_while(|digits| digits == b"a5").count();
    println!("{} of {STACK} bytes of stack were used", STACK - free);
    assert!(free > STACK / 3, "{free} bytes free");
    // The firmware looks at all of the stack in 1.3 s, and may be in the middle.
    chip.run_us(2_600_000);
    let found = chip.counter(&image, "FREE_STACK") as usize;
    assert_eq!(found, free / 4 * 4, "by the firmware");
}

/// Returns the address of the function that panics for an index out of bounds, and a place in the
/// source as its argument.
fn index_panic(path: &Path) -> (u64, PanicPlace) {
    let elf = fs::read(path).expect("the firmware");
    let places = panic_places(&Image::read(&elf, &RP2040).expect("an image"));
    let place = places.into_iter().find(|place| place.file.contains("core/src")).expect("a place");
    let file = object::File::parse(&*elf).expect("an ELF file");
    let is_panic = |name: &str| name.contains("panic_bounds_check") && !name.contains("Thunk");
    let function = file.symbols().find(|symbol| symbol.name().is_ok_and(is_panic));
    (function.expect("the panic of an index").address(), place)
}

/// Calls the panic of an index that is out of bounds, as from a place in the source.
#[test]
fn a_panic_restarts_the_board_which_reports_its_place() {
    let Some(path) = firmware_image() else { return };
    let (function, place) = index_panic(&path);
    let mut chip = Chip::start(&path).configured(fast_config(1000.0, StepDir::TMC2209));
    chip.drive_pin(ENABLE, Some(1));
    let reply = chip.execute(json!({ "call": [function, 0, 0, place.address], "run_us": 100 }));
    assert_eq!(reply["resets"][0][1], "forced", "{reply}");
    chip.received.clear();
    chip.assert_stopped_by_watchdog();
    let cause = FromBoard::Started(StartCause::Panic(place.number()));
    assert!(chip.received.contains(&cause), "{:?}", chip.received);
}

/// Waits for the board after a reset, and returns the cause that it reports, and its state.
fn started(chip: &mut Chip) -> (StartCause, State) {
    chip.wait_for_usb();
    chip.received.clear();
    chip.request(Command::Hello(Hello::OURS));
    let cause = chip.received.iter().find_map(|message| match message {
        FromBoard::Started(cause) => Some(*cause),
        _ => None,
    });
    (cause.expect("a cause"), chip.state())
}

/// Goes through all causes of a start, as the chip gives them (firmware/src/restart.rs), twice:
/// what one leaves in the registers must not change the next.
#[test]
fn every_start_reports_its_cause() {
    let Some(path) = firmware_image() else { return };
    let (panic, place) = index_panic(&path);
    let mut chip = Chip::start(&path);
    let failed = State::Fault(Fault::Watchdog);
    let fine = State::Unconfigured;
    let bootloader = |chip: &mut Chip| {
        let frame = chip.frame(Command::Bootloader);
        let sent = chip.cycle;
        chip.send(&frame, 20_000);
        assert!(chip.cycle > sent);
    };
    for _ in 0..2 {
        chip.execute(json!({ "reset": "power" }));
        assert_eq!(started(&mut chip), (StartCause::PowerOn, fine));
        chip.execute(json!({ "reset": "run" }));
        assert_eq!(started(&mut chip), (StartCause::ResetPin, fine));
        chip.hang();
        assert_eq!(started(&mut chip), (StartCause::Watchdog, failed));
        chip.execute(json!({ "reset": "system" }));
        assert_eq!(started(&mut chip), (StartCause::Requested, fine), "by a debugger");
        chip.execute(json!({ "call": [panic, 0, 0, place.address] }));
        assert_eq!(started(&mut chip), (StartCause::Panic(place.number()), failed));
        for way in ["uf2", "picoboot"] {
            bootloader(&mut chip);
            chip.execute(json!({ "downloaded": way }));
            chip.run_us(200_000);
            assert_eq!(started(&mut chip), (StartCause::Requested, fine), "{way}");
        }
        let nowhere = 0x3000_0000;
        chip.execute(json!({ "call": [nowhere] }));
        assert_eq!(started(&mut chip), (StartCause::HardFault, failed));
        assert_eq!(chip.counter(&path, "FAULT_PC"), nowhere);
        chip.execute(json!({ "reset": "bootsel" }));
        chip.execute(json!({ "downloaded": "uf2" }));
        chip.run_us(400_000);
        assert_eq!(started(&mut chip), (StartCause::Requested, fine), "with the button");
        chip.hang();
        assert_eq!(started(&mut chip), (StartCause::Watchdog, failed), "after a download");
    }
}

/// Runs the chip until its processor sleeps, so that no handler is active.
fn wait_for_sleep(chip: &mut Chip) {
    let slept = |chip: &mut Chip| {
        let reply = chip.execute(json!({ "load": true, "run_cycles": 100 }));
        reply["load"]["sleepCycles"].as_u64().expect("cycles")
    };
    let mut before = slept(chip);
    for _ in 0..1000 {
        let after = slept(chip);
        if after == before + 100 {
            return;
        }
        before = after;
    }
    panic!("the processor does not sleep");
}

/// Runs `code` (Thumb, up to an endless loop) in thread mode, with `stack` as the stack pointer.
fn run_code(chip: &mut Chip, code: &[u16], stack: u32) -> Value {
    // mov sp, r0
    let halves = [0x4685].iter().chain(code);
    let hex: String = halves.map(|half: &u16| format!("{:04x}", half.swap_bytes())).collect();
    chip.execute(json!({ "poke": [CODE, hex], "call": [CODE, stack], "run_us": 300 }))
}

/// Lets the stack overflow by a push of the program, and by the frame of an interrupt. The chip
/// itself refuses neither access below its memory; the firmware's guard does.
#[test]
fn a_stack_overflow_restarts_the_board_at_once() {
    let Some(path) = firmware_image() else { return };
    // cpsid i; push {r0-r7, lr}; b .
    let push: &[u16] = &[0xb672, 0xb5ff, 0xe7fe];
    // b .
    let interrupt: &[u16] = &[0xe7fe];
    // A chip for each: the end of a run may be within an interrupt, during which no other comes.
    let asleep = || {
        let mut chip = Chip::start(&path).configured(fast_config(1000.0, StepDir::TMC2209));
        chip.drive_pin(ENABLE, Some(1));
        wait_for_sleep(&mut chip);
        chip
    };
    for (name, code) in [("push", push), ("interrupt", interrupt)] {
        let fits = run_code(&mut asleep(), code, 0x2000_4000);
        assert!(fits["resets"].is_null(), "{name}: with a stack, nothing happens: {fits}");
        let mut chip = asleep();
        let reply = run_code(&mut chip, code, 0x2000_0000 + 16);
        assert_eq!(reply["resets"][0][1], "forced", "{name}: {reply}");
        assert_eq!(chip.pin_level(ENABLE), 1);
        let failed = State::Fault(Fault::Watchdog);
        assert_eq!(started(&mut chip), (StartCause::HardFault, failed), "{name}");
        let registers = ["FAULT_PC", "FAULT_LR"].map(|name| chip.counter(&path, name));
        assert_eq!(registers, [0, 0], "{name}: there was no memory for the registers");
    }
}

/// A fault with a stack leaves the address of its instruction, and that of the last call.
#[test]
fn a_fault_leaves_its_registers() {
    let Some(path) = firmware_image() else { return };
    let mut chip = Chip::start(&path);
    wait_for_sleep(&mut chip);
    // bl to the next instruction; udf #0
    let reply = run_code(&mut chip, &[0xf000, 0xf800, 0xde00], 0x2000_4000);
    assert_eq!(reply["resets"][0][1], "forced", "{reply}");
    assert_eq!(started(&mut chip).0, StartCause::HardFault);
    let registers = ["FAULT_PC", "FAULT_LR"].map(|name| chip.counter(&path, name));
    assert_eq!(registers, [CODE + 6, CODE + 6 + 1]);
    chip.execute(json!({ "reset": "power" }));
    assert_eq!(started(&mut chip).0, StartCause::PowerOn);
    let registers = ["FAULT_PC", "FAULT_LR"].map(|name| chip.counter(&path, name));
    assert_eq!(registers, [0, 0], "no fault ended the last run");
}
