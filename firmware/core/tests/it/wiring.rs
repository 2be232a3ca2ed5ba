//! Wirings that a board refuses, save wrong pins (`tests/tests/it/wrong_pins.rs`).

#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::BuildLimits;
use plumb_core::timing::DriverTiming;
use plumb_protocol::Wiring;
use plumb_protocol::boards::{ALL, Board, PICO_2};
use plumb_protocol::message::{Command, Hello, Refusal};
use plumb_protocol::units::Nanoseconds;
use plumb_protocol::wiring::{Drivers, StepDir, WiringError};

use crate::common::BUILD;
use crate::common::bench::Bench;

/// Returns what the firmware of `board` answers to a wiring of it.
fn answer(board: &Board, change: impl Fn(&mut Wiring)) -> Result<(), Refusal> {
    let build = BuildLimits { chip: Some(board.chip), ..BUILD };
    let mut wiring = Wiring { board: board.kind, pins: board.pins, ..Wiring::example() };
    change(&mut wiring);
    let mut bench = Bench::new(build);
    assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
    bench.send(Command::Wire(wiring))
}

/// Returns times with a pulse of this width, ns.
fn pulse(high: u16) -> StepDir {
    StepDir { high: Nanoseconds(high), ..StepDir::DM542 }
}

#[test]
fn pulses_that_a_chip_cannot_make_are_refused_by_its_boards() {
    for board in ALL {
        let widest = if board.kind == PICO_2.kind { 3420 } else { 4104 };
        let answer = |high| answer(board, |it| it.drivers = Drivers::StepDir(pulse(high)));
        assert_eq!(answer(widest), Ok(()), "{}", board.name);
        let refused = Err(Refusal::Wiring(WiringError::Pulse));
        assert_eq!(answer(widest + 1), refused, "{}", board.name);
    }
}

/// An inverted input needs a pull-down, which does not hold an RP2350's input low (RP2350-E9).
#[test]
fn an_inverted_emergency_input_is_refused_where_inputs_latch() {
    for board in ALL {
        let answer = |inverted| answer(board, |it| it.pins.emergency.inverted = inverted);
        let refused = Err(Refusal::Wiring(WiringError::InvertedEmergency));
        let expected = if board.kind == PICO_2.kind { refused } else { Ok(()) };
        assert_eq!(answer(true), expected, "{}", board.name);
        assert_eq!(answer(false), Ok(()), "{}", board.name);
    }
}

/// The step generator of the RP2040, which these tests count with, follows the same rule.
#[test]
fn the_widest_pulse_is_that_of_the_step_generator() {
    assert!(DriverTiming::new(&pulse(4104)).is_some());
    assert!(DriverTiming::new(&pulse(4105)).is_none());
}
