//! Motor drivers on a UART as the board sees them: nothing has current and nothing moves before
//! they are set up, and a fault of one stops the board.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_protocol::boards::PICO;
use plumb_protocol::message::*;
use plumb_protocol::units::{Micros, Milliamperes, Rate, Steps16};
use plumb_protocol::wiring::{Drivers, Tmc2209};
use plumb_protocol::{Config, Wiring};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{BUILD, config};

/// Returns the wiring of a Pico with TMC2209 on a UART.
fn tmc2209() -> Wiring {
    Wiring::pico(Drivers::Tmc2209(Tmc2209::of(&PICO)))
}

/// Returns a configured board whose drivers the test sets up.
fn configured() -> Bench {
    let mut bench = Bench::greeted(BUILD);
    bench.harness.sets_up_drivers = false;
    assert_eq!(bench.send(Command::Wire(tmc2209())), Ok(()));
    assert_eq!(bench.send(Command::Configure(config())), Ok(()));
    bench
}

fn jog(bench: &mut Bench) -> Result<(), Refusal> {
    let jog = Jog { motor: 0, distance: Steps16(160), rate: Rate(40 << 8) };
    bench.send(Command::Jog(jog))
}

/// Runs the board for some tenths of a second, with a heartbeat of the host in each.
fn run(bench: &mut Bench, tenths: u32) {
    for _ in 0..tenths {
        let _ = bench.send(Command::Status);
        bench.run_ms(100);
    }
}

fn fail(bench: &mut Bench, fault: DriverFault) {
    bench.harness.on_driver_failure(Micros(bench.now), fault);
    bench.collect();
}

#[test]
fn drivers_get_current_and_motors_move_once_they_are_set_up() {
    let mut bench = configured();
    let asked = bench.tick();
    assert!(asked.set_up_drivers && !asked.drivers_enabled, "{asked:?}");
    assert_eq!(jog(&mut bench), Ok(()), "as during the time after ENABLE");
    run(&mut bench, 5);
    assert!(bench.outputs.set_up_drivers && !bench.outputs.drivers_enabled);
    assert_eq!(bench.harness.board.positions(), [0; 3]);

    bench.harness.on_drivers_ready();
    let asked = bench.tick();
    assert!(!asked.set_up_drivers && asked.drivers_enabled, "{asked:?}");
    bench.run_ms(129);
    assert_eq!(bench.harness.board.positions(), [0; 3], "130 ms after ENABLE");
    run(&mut bench, 5);
    assert_eq!(bench.harness.board.positions(), [160, 0, 0]);
}

#[test]
fn a_configuration_with_the_wiring_in_force_leaves_the_drivers_as_they_are() {
    let mut bench = configured();
    bench.harness.on_drivers_ready();
    bench.run_ms(140);
    let wirings = bench.harness.board.wiring_generation();
    let mut slower = config();
    slower.motors[0].max_rate.0 /= 2;
    bench.greet();
    for config in [config(), slower] {
        assert_eq!(bench.send(Command::Wire(tmc2209())), Ok(()));
        assert_eq!(bench.send(Command::Configure(config)), Ok(()));
        assert_eq!(bench.harness.board.wiring_generation(), wirings);
        for _ in 0..1000 {
            let asked = bench.tick();
            assert!(asked.drivers_enabled && !asked.set_up_drivers, "{asked:?}");
        }
    }
    assert_eq!(jog(&mut bench), Ok(()), "the motors move at once");
    run(&mut bench, 5);
    assert_eq!(bench.harness.board.positions(), [160, 0, 0]);
    // Other microsteps are other registers of the drivers, and other currents another wiring.
    let finer = Config { microsteps: config().microsteps / 2, ..config() };
    let weaker = Tmc2209 { hold: Milliamperes(700), ..Tmc2209::of(&PICO) };
    let weaker = Wiring::pico(Drivers::Tmc2209(weaker));
    for (wiring, config) in [(tmc2209(), finer), (weaker, finer)] {
        assert_eq!(bench.send(Command::Wire(wiring)), Ok(()));
        assert_eq!(bench.send(Command::Configure(config)), Ok(()));
        let asked = bench.tick();
        assert!(!asked.drivers_enabled && asked.set_up_drivers, "{asked:?}");
        bench.harness.on_drivers_ready();
        assert!(bench.tick().drivers_enabled);
    }
}

#[test]
fn other_drivers_are_not_set_up() {
    let mut bench = Bench::configured(config());
    let asked = bench.tick();
    assert!(!asked.set_up_drivers && asked.drivers_enabled, "{asked:?}");
    fail(&mut bench, DriverFault::Hat);
    assert_eq!(bench.send(Command::ClearFault), Ok(()));
    assert!(!bench.tick().set_up_drivers);
}

#[test]
fn a_fault_of_a_driver_stops_the_board_and_clearing_it_sets_the_drivers_up_again() {
    let mut bench = configured();
    bench.harness.on_drivers_ready();
    bench.run_ms(140);
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(10, BALL);
    assert_ne!(bench.harness.board.rates(), [0; 3]);

    fail(&mut bench, DriverFault::Short(1));
    fail(&mut bench, DriverFault::Silent(2));
    assert_eq!(bench.faults(), [Fault::Driver(DriverFault::Short(1))], "the first one");
    bench.run_ms(400);
    assert_eq!(bench.harness.board.rates(), [0; 3]);
    assert!(bench.outputs.drivers_enabled, "the others hold the ball");
    assert!(!bench.outputs.set_up_drivers, "not before the fault is cleared");

    assert_eq!(bench.send(Command::ClearFault), Ok(()));
    let asked = bench.tick();
    assert!(asked.set_up_drivers && asked.drivers_enabled, "{asked:?}");
    assert_eq!(jog(&mut bench), Ok(()));
    bench.run_ms(100);
    let stood = bench.harness.board.positions();
    bench.harness.on_drivers_ready();
    run(&mut bench, 5);
    let jogged = bench.harness.board.positions();
    assert_eq!([jogged[0] - stood[0], jogged[1] - stood[1]], [160, 0]);
}

#[test]
fn a_driver_that_fails_with_another_fault_is_set_up_too() {
    for is_first in [true, false] {
        let mut bench = configured();
        bench.harness.on_drivers_ready();
        bench.run_ms(140);
        if is_first {
            fail(&mut bench, DriverFault::Short(1));
        }
        bench.harness.on_emergency_stop(Micros(bench.now), [0; 3]);
        if !is_first {
            fail(&mut bench, DriverFault::Short(1));
        }
        bench.run_ms(400);
        assert_eq!(bench.harness.board.state(), State::Fault(Fault::EmergencyStop));
        assert_eq!(bench.send(Command::ClearFault), Ok(()));
        let asked = bench.tick();
        assert!(asked.set_up_drivers && asked.drivers_enabled, "{asked:?}");
    }
}

#[test]
fn drivers_whose_set_up_failed_stay_off_until_it_succeeds() {
    let mut bench = configured();
    bench.tick();
    for _ in 0..2 {
        fail(&mut bench, DriverFault::Silent(0));
        let asked = bench.tick();
        assert!(!asked.set_up_drivers && !asked.drivers_enabled, "{asked:?}");
        assert_eq!(bench.send(Command::ClearFault), Ok(()));
        let asked = bench.tick();
        assert!(asked.set_up_drivers && !asked.drivers_enabled, "{asked:?}");
    }
    bench.harness.on_drivers_ready();
    assert!(bench.tick().drivers_enabled);
}

#[test]
fn readings_go_to_a_host_that_was_greeted() {
    let readings = [0, 1, 2].map(|motor| DriverReading {
        is_hot: motor == 1,
        has_open_load: false,
        has_lost_replies: motor == 2,
        stall_guard: Some(100 * motor),
    });
    let mut bench = Bench::new(BUILD);
    bench.harness.on_driver_readings(Micros(0), readings);
    bench.collect();
    assert_eq!(bench.received, []);
    bench.greet();
    bench.received.clear();
    bench.harness.on_driver_readings(Micros(7), readings);
    bench.collect();
    let report = DriverReport { time: Micros(7), motors: readings.into() };
    assert_eq!(bench.received, [FromBoard::Drivers(report)]);
}

#[test]
fn currents_that_the_resistor_does_not_allow_are_refused() {
    let mut bench = Bench::greeted(BUILD);
    let driver = Tmc2209 { run: Milliamperes(1900), ..Tmc2209::of(&PICO) };
    assert_eq!(bench.send(Command::Wire(Wiring::pico(Drivers::Tmc2209(driver)))), Ok(()));
    let refused = Err(Refusal::Config(ConfigField::Drivers));
    assert_eq!(bench.send(Command::Configure(config())), refused);
    assert_eq!(bench.harness.board.generation(), 0);
}
