#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_protocol::boards::PICO;
use plumb_protocol::frame::{self, Accumulator};
use plumb_protocol::message::{
    Command, DriverFault, DriverReading, Fault, FromBoard, Hello, Jog, StartCause, State, ToBoard,
};
use plumb_protocol::units::{Micros, Rate, Steps16};
use plumb_protocol::wiring::{Drivers, Tmc2209};
use plumb_protocol::{Config, Wiring};

use super::DriverTrouble;
use crate::tmc2209::Trouble;
use crate::{EMULATED, EmulatedBoard};

const BEGIN: Micros = Micros(1_000_000);
const END: Micros = Micros(2_000_000);
/// Time in which a fault of a driver stops the board, µs.
const LIMIT_US: u64 = 50_000;
/// The same for a driver that does not answer: it counts as lost after 0.3 s.
const SILENCE_US: u64 = 350_000;
/// Time for the set-up, ENABLE and a jog, µs.
const ENOUGH_US: u64 = 1_000_000;

/// Returns the fault of a motor's driver.
type FaultOf = fn(u8) -> DriverFault;

/// A configured board with TMC2209 on a UART, one of which has a trouble, and its host.
struct Bench {
    board: EmulatedBoard,
    host: Accumulator,
    id: u16,
}

impl Bench {
    fn new(motor: u8, trouble: Trouble) -> Self {
        let mut board = EmulatedBoard::new(EMULATED);
        board.trouble_driver(DriverTrouble { motor, trouble, time: BEGIN..END });
        let mut bench = Self { board, host: Accumulator::new(), id: 0 };
        bench.send(Command::Hello(Hello::OURS));
        bench.send(Command::Wire(Wiring::pico(Drivers::Tmc2209(Tmc2209::of(&PICO)))));
        bench.send(Command::Configure(Config::example()));
        bench
    }

    fn send(&mut self, command: Command) {
        self.id += 1;
        let frame = frame::encode(&ToBoard { id: self.id, command }).unwrap();
        self.board.write(&frame);
    }

    /// Runs to `end`, µs, with a heartbeat of the host every 0.1 s. Returns the board's messages.
    fn run_to(&mut self, end: u64) -> Vec<FromBoard> {
        while self.board.now().0 < end {
            self.send(Command::Status);
            let pause = Micros(end.min(self.board.now().0 + 100_000));
            self.board.run_to(pause).unwrap();
        }
        let (bytes, host) = (self.board.read(), &mut self.host);
        bytes.into_iter().filter_map(|byte| host.push(byte)).map(Result::unwrap).collect()
    }

    /// Runs to `end`, µs. Returns the faults that are reported, and when.
    fn faults(&mut self, end: u64) -> Vec<(u64, Fault)> {
        let messages = self.run_to(end).into_iter();
        let faults = messages.filter_map(|message| match message {
            FromBoard::Fault(report) => Some((report.time.0, report.fault)),
            _ => None,
        });
        faults.collect()
    }

    /// Runs to `end`, µs. Returns the drivers' newest readings.
    fn readings(&mut self, end: u64) -> [DriverReading; 3] {
        let messages = self.run_to(end).into_iter();
        let mut readings = messages.filter_map(|message| match message {
            FromBoard::Drivers(report) => Some(report.motors),
            _ => None,
        });
        readings.next_back().unwrap().steppable(DriverReading::default())
    }

    /// Clears the fault and jogs motor A. Returns how far it has turned, 1/16 steps.
    fn clear_and_jog(&mut self) -> i32 {
        let before = self.board.core().positions()[0];
        self.send(Command::ClearFault);
        self.send(Command::Jog(Jog { motor: 0, distance: Steps16(160), rate: Rate(40 << 8) }));
        self.run_to(self.board.now().0 + ENOUGH_US);
        self.board.core().positions()[0] - before
    }
}

#[test]
fn a_fault_of_a_driver_stops_the_board_until_it_is_over_and_cleared() {
    let faults: [(Trouble, FaultOf); 5] = [
        (Trouble::Overtemperature, DriverFault::Overtemperature),
        (Trouble::Short, DriverFault::Short),
        (Trouble::Undervoltage, DriverFault::Undervoltage),
        (Trouble::Reset, DriverFault::Reset),
        (Trouble::Silent, DriverFault::Silent),
    ];
    for (trouble, fault) in faults {
        for motor in 0..3 {
            let mut bench = Bench::new(motor, trouble);
            let expected = Fault::Driver(fault(motor));
            assert_eq!(bench.faults(BEGIN.0), [], "{trouble:?}");
            let limit_us = if trouble == Trouble::Silent { SILENCE_US } else { LIMIT_US };
            let found = bench.faults(BEGIN.0 + limit_us);
            assert!(matches!(found[..], [(_, found)] if found == expected), "{found:?}");
            bench.send(Command::ClearFault);
            let again = bench.faults(END.0).into_iter().map(|(_, fault)| fault);
            let lasts = if trouble == Trouble::Reset { vec![] } else { vec![expected] };
            assert_eq!(again.collect::<Vec<_>>(), lasts, "{trouble:?}");
            assert_eq!(bench.clear_and_jog(), 160, "{trouble:?}");
            assert_eq!(bench.board.state(), State::Ready);
        }
    }
}

#[test]
fn a_warning_of_a_driver_is_told_and_the_board_goes_on() {
    let mut bench = Bench::new(1, Trouble::Hot);
    let hot = |readings: [DriverReading; 3]| readings.map(|reading| reading.is_hot);
    assert_eq!(hot(bench.readings(BEGIN.0)), [false; 3]);
    assert_eq!(hot(bench.readings(BEGIN.0 + LIMIT_US)), [false, true, false]);
    assert_eq!(bench.clear_and_jog(), 160, "the board goes on");
    assert_eq!(hot(bench.readings(END.0 + ENOUGH_US)), [false; 3]);
    assert_eq!(bench.board.state(), State::Ready);
}

#[test]
fn an_open_coil_is_told_while_the_motor_turns() {
    let mut bench = Bench::new(0, Trouble::OpenCoil);
    let open = |readings: [DriverReading; 3]| readings.map(|reading| reading.has_open_load);
    assert_eq!(open(bench.readings(BEGIN.0 + 2 * LIMIT_US)), [false; 3], "at standstill");
    bench.send(Command::Jog(Jog { motor: 0, distance: Steps16(160), rate: Rate(40 << 8) }));
    assert_eq!(open(bench.readings(BEGIN.0 + 4 * LIMIT_US)), [true, false, false]);
    assert_eq!(open(bench.readings(END.0)), [false; 3], "it stands again");
}

#[test]
fn a_driver_that_failed_before_an_emergency_stop_is_watched_after_it() {
    let mut bench = Bench::new(1, Trouble::Short);
    bench.run_to(BEGIN.0 + LIMIT_US);
    bench.board.open_emergency([0; 3]);
    bench.run_to(END.0);
    assert_eq!(bench.clear_and_jog(), 160);
    let now = bench.board.now();
    let time = now..Micros(u64::MAX);
    bench.board.trouble_driver(DriverTrouble { motor: 2, trouble: Trouble::Silent, time });
    let told = bench.faults(now.0 + SILENCE_US);
    let silent = Fault::Driver(DriverFault::Silent(2));
    assert!(matches!(told[..], [(_, fault)] if fault == silent), "{told:?}");
}

#[test]
fn a_board_that_restarts_sets_its_drivers_up_again() {
    let mut bench = Bench::new(0, Trouble::Hot);
    assert_eq!(bench.clear_and_jog(), 160);
    bench.board.restart(StartCause::PowerOn);
    bench.send(Command::Hello(Hello::OURS));
    bench.send(Command::Wire(Wiring::pico(Drivers::Tmc2209(Tmc2209::of(&PICO)))));
    bench.send(Command::Configure(Config::example()));
    assert_eq!(bench.clear_and_jog(), 160);
}
