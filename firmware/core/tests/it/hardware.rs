//! Events of the chip: the emergency input, the cause of the start, the configuration in flash.

#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::BuildLimits;
use plumb_core::board::FlashTask;
use plumb_protocol::config::Motor;
use plumb_protocol::diagnostics::{
    ChipCounts, ChipMeasurement, Diagnostics, Measurement, ProcessorFault, PulseCount,
};
use plumb_protocol::frame::encode;
use plumb_protocol::message::{Fault, Jog, Refusal, StartCause, State};
use plumb_protocol::units::{Micros, Rate, Steps16};
use plumb_protocol::wiring::{Coils, Drivers};
use plumb_protocol::{Command, Config, FromBoard, Hello, Provenance, ToBoard, Wiring};

use crate::common::bench::Bench;
use crate::common::{BUILD, config, wiring};

fn jog(bench: &mut Bench) -> Result<(), Refusal> {
    let rate = Rate::from_si(400.0).unwrap();
    bench.send(Command::Jog(Jog { motor: 0, distance: Steps16(16_000), rate }))
}

/// Opens the emergency input, with `missing` pulses of the last tick cut off.
fn emergency(bench: &mut Bench, missing: [i32; 3]) {
    bench.harness.on_emergency_stop(Micros(bench.now), missing);
    bench.collect();
}

#[test]
fn an_emergency_stop_counts_the_pulses_that_were_cut_off() {
    for reversed in [false, true] {
        let mut motors = config().motors;
        motors[0].reversed = reversed;
        let mut bench = Bench::configured(Config { motors, microsteps: 8, ..config() });
        assert_eq!(jog(&mut bench), Ok(()));
        bench.run_ms(200);
        let [planned, ..] = bench.harness.board.positions();
        assert!(planned > 100);
        // The direction line is high where the motor pays out, unless it is reversed.
        let missing = if reversed { -3 } else { 3 };
        emergency(&mut bench, [missing, 0, 0]);
        let tick = bench.tick();
        assert!(bench.harness.board.pulses().motors.iter().all(|pulses| pulses.count == 0));
        assert!(!tick.drivers_enabled);
        assert_eq!(bench.harness.board.positions(), [planned - 3 * 2, 0, 0]);
        assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
        assert_eq!(bench.faults(), [Fault::EmergencyStop]);
    }
}

#[test]
fn an_emergency_stop_is_cleared_only_after_the_input_has_closed() {
    let mut bench = Bench::configured(config());
    for _ in 0..3 {
        emergency(&mut bench, [0; 3]);
        assert_eq!(bench.send(Command::ClearFault), Err(Refusal::Faulted(Fault::EmergencyStop)));
        assert!(!bench.tick().drivers_enabled);
        assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
        // A host's frame may arrive at any moment of a tick.
        for off_us in [0, 199] {
            let frame =
                encode(&ToBoard { id: 500 + off_us as u16, command: Command::ClearFault }).unwrap();
            bench.received.clear();
            bench.harness.receive(Micros(bench.now - off_us), &frame);
            assert_eq!(bench.answers(), [Err(Refusal::Faulted(Fault::EmergencyStop))]);
        }
    }
    // One tick that no report of an open input precedes.
    bench.tick();
    assert_eq!(bench.send(Command::ClearFault), Ok(()));
    assert!(bench.tick().drivers_enabled);
    assert_eq!(bench.harness.board.state(), State::Ready);
    assert_eq!(jog(&mut bench), Ok(()));
    bench.run_ms(20);
    assert!(bench.harness.board.positions()[0] > 0);
}

#[test]
fn an_emergency_stop_replaces_another_fault() {
    let mut bench = Bench::configured(config());
    assert_eq!(jog(&mut bench), Ok(()));
    // The host is silent for too long.
    bench.run_ms(400);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::HostSilent));
    emergency(&mut bench, [0; 3]);
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
}

#[test]
fn a_board_reports_its_start_cause_and_begins_in_a_fault_after_its_own_error() {
    use StartCause::*;
    for (cause, stopped) in [
        (PowerOn, false),
        (BrownOut, false),
        (ResetPin, false),
        (Requested, false),
        (Watchdog, true),
        (Panic(0x1a2b_3c4d), true),
        (HardFault, true),
    ] {
        let mut bench = Bench::new(BUILD);
        bench.harness.board.set_start_cause(cause);
        bench.harness.board.restore(&wiring(), &config());
        assert!(!bench.tick().drivers_enabled, "{cause:?}: no current before a Hello");
        assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
        assert_eq!(bench.tick().drivers_enabled, !stopped, "{cause:?}");
        assert!(bench.received.contains(&FromBoard::Started(cause)));
        let answer = if stopped { Err(Refusal::Faulted(Fault::Watchdog)) } else { Ok(()) };
        assert_eq!(jog(&mut bench), answer, "{cause:?}");
        let _ = bench.send(Command::Stop);
        let _ = bench.send(Command::ClearFault);
        assert_eq!(bench.harness.board.state(), State::Ready);
    }
}

#[test]
fn a_host_of_another_version_gets_hello_and_provenance_alone() {
    let mut bench = Bench::new(BUILD);
    let _ = bench.send(Command::Hello(Hello { version: 0, ..Hello::OURS }));
    let [FromBoard::Hello(hello), FromBoard::Provenance(provenance)] = bench.received[..] else {
        panic!("{:?}", bench.received)
    };
    assert!(!hello.accepted);
    assert_eq!(provenance, Provenance::EMULATED);
}

/// What a chip has counted.
const COUNTED: ChipCounts = ChipCounts {
    late_ticks: 1,
    late_at_rest: 20,
    free_stack: Some(20_000),
    usb_resets: 2,
    fault: Some(ProcessorFault { pc: 0x1000_1234, lr: 0x2000_5679 }),
    dropped_frames: 300,
};

#[test]
fn the_counts_of_the_chip_answer_a_diagnose_in_every_state() {
    for mut bench in [Bench::new(BUILD), Bench::configured(config()), Bench::seeking()] {
        bench.harness.board.set_start_cause(StartCause::ResetPin);
        assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
        bench.harness.receive(Micros(bench.now), &[1, 2, 3, 0]);
        assert!(!bench.tick().diagnose);
        assert_eq!(bench.send_as(77, Command::Diagnose), Ok(()));
        assert!(bench.tick().diagnose);
        bench.received.clear();
        bench.harness.on_diagnosed(COUNTED);
        bench.collect();
        let start = StartCause::ResetPin;
        let told = Diagnostics { id: 77, start, bad_frames: 1, chip: COUNTED };
        assert_eq!(bench.received, [FromBoard::Diagnostics(told)]);
        // It is told once.
        bench.harness.on_diagnosed(COUNTED);
        bench.collect();
        assert_eq!(bench.received.len(), 1);
    }
}

#[test]
fn a_measurement_is_answered_by_the_chip() {
    let mut bench = Bench::configured(config());
    assert_eq!(bench.send_as(78, Command::Measure), Ok(()));
    assert!(bench.tick().measure);
    bench.received.clear();
    let pulses = [PulseCount { low: 1, high: 2 }; 3];
    let chip = ChipMeasurement { pulses: pulses.into(), time_us: 4, usb_frame: Some(5) };
    for measured in [Some(chip), Some(chip), None] {
        bench.harness.on_measured(Micros(bench.now), measured);
    }
    bench.collect();
    assert_eq!(bench.received, [FromBoard::Measurement(Measurement { id: 78, chip })], "once");
    assert!(!bench.tick().measure);
    // A chip that cannot measure.
    let _ = bench.send_as(79, Command::Measure);
    bench.harness.on_measured(Micros(bench.now), None);
    bench.collect();
    let refused = |message: &FromBoard| {
        matches!(message, FromBoard::Answer(answer) if answer.id == 79
            && answer.refusal == Some(Refusal::Unsupported))
    };
    assert!(bench.received.iter().any(refused), "{:?}", bench.received);
}

#[test]
fn a_measurement_is_refused_with_coils_and_in_motion() {
    let coils = Coils { duty_percent: 50 };
    for drivers in [Drivers::Coils(coils), Drivers::MotorHats(coils)] {
        let slow = |motor| Motor { max_rate: Rate(100 << 8), ..motor };
        let motors = config().motors.map(slow);
        let mut bench = Bench::wired(Wiring::pico(drivers), Config { motors, ..config() });
        assert_eq!(bench.send(Command::Measure), Err(Refusal::CoilsConfigured));
        assert!(!bench.tick().measure);
    }
    let mut bench = Bench::seeking();
    assert_eq!(bench.send(Command::Measure), Err(Refusal::Busy(State::Seeking)));
    assert_eq!(bench.send(Command::TestFlash), Err(Refusal::Busy(State::Seeking)));
}

#[test]
fn a_test_of_the_flash_is_answered_when_it_is_done() {
    for (written, refusal) in [(true, None), (false, Some(Refusal::NotStored))] {
        let mut bench = Bench::configured(config());
        assert_eq!(bench.send_as(80, Command::TestFlash), Ok(()));
        let asked = bench.tick();
        assert_eq!(asked.flash, Some(FlashTask::Test), "{asked:?}");
        assert_eq!(jog(&mut bench), Err(Refusal::Busy(State::Storing)));
        bench.received.clear();
        bench.harness.on_stored(Micros(bench.now), written);
        bench.collect();
        let answered = |message: &FromBoard| {
            matches!(message, FromBoard::Answer(answer) if answer.id == 80
                && answer.refusal == refusal)
        };
        assert!(bench.received.iter().any(answered), "{:?}", bench.received);
        let asked = bench.tick();
        assert_eq!(asked.flash, None, "{asked:?}");
        // The next Store writes the configuration.
        assert_eq!(bench.send(Command::Store), Ok(()));
        let asked = bench.tick();
        assert_eq!(asked.flash, Some(FlashTask::Store), "{asked:?}");
    }
}

#[test]
fn motors_have_current_from_the_first_matching_hello_on() {
    let mut bench = Bench::new(BUILD);
    bench.harness.board.restore(&wiring(), &config());
    assert!(!bench.tick().drivers_enabled);
    let other = Hello { version: 0, ..Hello::OURS };
    let _ = bench.send(Command::Hello(other));
    assert!(!bench.tick().drivers_enabled);
    assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
    assert!(bench.tick().drivers_enabled);
    // A host of another version takes no current from motors that hold the ball.
    let _ = bench.send(Command::Hello(other));
    assert!(bench.tick().drivers_enabled);
}

#[test]
fn a_stored_configuration_is_restored_but_moves_nothing_before_a_hello() {
    let mut bench = Bench::new(BUILD);
    bench.harness.board.restore(&wiring(), &config());
    assert_eq!(bench.harness.board.state(), State::Ready);
    assert_eq!(bench.harness.board.config(), Some(&config()));
    assert_eq!(jog(&mut bench), Err(Refusal::NotGreeted));
    assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
    assert_eq!(jog(&mut bench), Ok(()));
    bench.run_ms(20);
    assert!(bench.harness.board.positions()[0] > 0);
}

#[test]
fn a_stored_configuration_that_is_out_of_range_is_ignored() {
    let mut bench = Bench::new(BuildLimits { max_pulse_rate: 100, ..BUILD });
    bench.harness.board.restore(&wiring(), &config());
    assert_eq!(bench.harness.board.state(), State::Unconfigured);
}

#[test]
fn a_store_is_answered_once_it_is_written_and_nothing_moves_meanwhile() {
    let mut bench = Bench::configured(config());
    for (written, answer) in [(true, Ok(())), (false, Err(Refusal::NotStored))] {
        bench.answers();
        let _ = bench.send(Command::Store);
        assert_eq!(bench.tick().flash, Some(FlashTask::Store));
        let _ = jog(&mut bench);
        assert_eq!(bench.answers(), [Err(Refusal::Busy(State::Storing))]);
        bench.harness.on_stored(Micros(bench.now), written);
        assert_eq!(bench.answers(), [answer]);
        assert_eq!(bench.tick().flash, None);
    }
    assert_eq!(jog(&mut bench), Ok(()));
    bench.tick();
    assert_eq!(bench.send(Command::Store), Err(Refusal::Busy(State::Jogging)));
}

#[test]
fn a_store_without_storage_or_configuration_is_refused() {
    let mut bench = Bench::greeted(BuildLimits { storage: false, ..BUILD });
    assert_eq!(bench.send(Command::Store), Err(Refusal::Unsupported));
    let mut bench = Bench::greeted(BUILD);
    assert_eq!(bench.send(Command::Store), Err(Refusal::Unconfigured));
}

/// Ten late ticks within a second are counted; one more stops the board.
#[test]
fn many_late_ticks_within_a_second_stop_the_board() {
    let mut bench = Bench::configured(config());
    let late = |bench: &mut Bench| {
        let (now, harness) = (Micros(bench.now), &mut bench.harness);
        harness.board.on_late_tick(now, &mut harness.outbox);
        bench.tick();
    };
    for _ in 0..3 {
        (0..10).for_each(|_| late(&mut bench));
        bench.run_ms(1000);
    }
    assert_eq!(bench.harness.board.state(), State::Ready);
    (0..11).for_each(|_| late(&mut bench));
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::LateTicks));
    bench.collect();
    let told = bench.received.iter().rev().find_map(|message| match message {
        FromBoard::Telemetry(telemetry) => Some(telemetry.late_ticks),
        _ => None,
    });
    assert_eq!(told, Some(41));
}

#[test]
fn a_board_with_a_wrong_clock_refuses_to_drive() {
    let mut bench = Bench::new(BUILD);
    bench.harness.board.restore(&wiring(), &config());
    bench.harness.board.refuse_clock();
    assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
    let refused = Err(Refusal::Faulted(Fault::Clock));
    assert_eq!(bench.send(Command::ClearFault), refused);
    assert_eq!(bench.send(Command::Wire(wiring())), Ok(()));
    assert_eq!(bench.send(Command::Configure(config())), refused);
    assert_eq!(jog(&mut bench), refused);
    assert_eq!(bench.send_as(77, Command::Diagnose), Ok(()));
}
