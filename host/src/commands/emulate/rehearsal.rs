//! Options of `plumb emulate` for what goes wrong by plan: a rehearsal.

use std::ops::Range;
use std::path::Path;

use clap::{Args, ValueEnum};
use plumb_protocol::units::Micros;
use plumb_runtime::rig::{Driver, Rig};
use plumb_sim::emulator::tmc2209::Trouble;
use plumb_sim::emulator::{DriverTrouble, EmulatedBoard};

use crate::cli::choices::MotorName;
use crate::cli::exit::{Failure, failed};
use crate::cli::numbers;

/// What goes wrong with the emulated board.
#[derive(Args)]
#[command(next_help_heading = "A rehearsal")]
pub(super) struct RehearsalOptions {
    /// Time after which the emergency button is pressed for 3 s, above 0, to 1e9 s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    emergency_after: Option<f64>,
    /// Trouble of a motor's TMC2209 on a UART, for 10 s
    #[arg(long, value_enum, value_name = "TROUBLE")]
    driver_trouble: Option<Trouble>,
    /// Motor whose driver has the trouble
    #[arg(long, value_enum, value_name = "MOTOR", ignore_case = true)]
    #[arg(default_value = "A", requires = "driver_trouble")]
    driver_trouble_motor: MotorName,
    /// Time after which the driver has the trouble, above 0, to 1e9 s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    #[arg(default_value_t = 10.0, requires = "driver_trouble")]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    driver_trouble_after: f64,
}

/// Time for which the emergency button is pressed, seconds.
const PRESS_S: f64 = 3.0;
/// Time for which a driver has its trouble, seconds.
const TROUBLE_S: f64 = 10.0;

/// Something that goes wrong by plan, or is well again.
pub(super) struct Rehearsed {
    /// When, on the board's clock.
    pub(super) time: Micros,
    /// What, in words.
    text: String,
    /// Whether all is well again.
    is_end: bool,
    /// Whether it is the trouble of a driver on a UART.
    needs_driver_uart: bool,
}

/// Advice about drivers that have no UART.
const NO_DRIVER_UART: &str = "Only these tell their troubles: write `driver = { tmc2209-uart = \
     { run_current = 0.8 } }` into [motors] of the rig file";

/// Adds that something goes wrong at the beginning of `time`, and is well again at its end.
fn add(
    rehearsed: &mut Vec<Rehearsed>,
    time: &Range<Micros>,
    [begin, end]: [String; 2],
    needs_driver_uart: bool,
) {
    rehearsed.extend([
        Rehearsed { time: time.start, text: begin, is_end: false, needs_driver_uart },
        Rehearsed { time: time.end, text: end, is_end: true, needs_driver_uart },
    ]);
}

impl Rehearsed {
    /// Says what goes wrong now, or when that shows: the board has only the drivers for which a
    /// host configures it.
    pub(super) fn tell(&self, board: &EmulatedBoard) {
        let time = self.time.0 as f64 * 1e-6;
        if board.has_driver_uart() || !self.needs_driver_uart {
            note!("rehearsal, {time:.1} s: {}", self.text);
        } else if !self.is_end {
            tell!(
                "rehearsal, {time:.1} s: {}. It shows once a host configures this board for \
                 TMC2209 on a UART, as a rig file with `driver = {{ tmc2209-uart = {{ run_current \
                 = 0.8 }} }}` in [motors] does",
                self.text
            );
        }
    }
}

impl RehearsalOptions {
    /// Plans for the board of `rig` what the options say. Returns it in the order of time.
    ///
    /// # Errors
    /// Where the rig's drivers have no UART, over which a trouble would be told.
    pub(super) fn plan(
        &self,
        board: &mut EmulatedBoard,
        rig: Option<(&Path, &Rig)>,
    ) -> Result<Vec<Rehearsed>, Failure> {
        let mut rehearsed = Vec::new();
        if let Some(seconds) = self.emergency_after {
            let time = span(seconds, PRESS_S);
            board.press_emergency_button(time.clone());
            let button = "the emergency button is";
            let texts = ["pressed", "released"].map(|is| format!("{button} {is}"));
            add(&mut rehearsed, &time, texts, false);
        }
        self.plan_trouble(board, rig, &mut rehearsed)?;
        rehearsed.sort_by_key(|it| it.time);
        Ok(rehearsed)
    }

    /// Plans the trouble of a driver.
    fn plan_trouble(
        &self,
        board: &mut EmulatedBoard,
        rig: Option<(&Path, &Rig)>,
        rehearsed: &mut Vec<Rehearsed>,
    ) -> Result<(), Failure> {
        let Some(name) = self.driver_trouble else { return Ok(()) };
        let has_uart = |rig: &Rig| matches!(rig.motors.driver, Driver::Tmc2209Uart(_));
        if let Some((file, _)) = rig.filter(|(_, rig)| !has_uart(rig)) {
            return Err(failed(format!(
                "{}: --driver-trouble has no effect: the drivers of this rig file are not TMC2209 \
                 on a UART. {NO_DRIVER_UART}",
                file.display()
            )));
        }
        let time = span(self.driver_trouble_after, TROUBLE_S);
        let driver = format!("the driver of motor {:?}", self.driver_trouble_motor);
        let option = name.to_possible_value().unwrap_or_default();
        let begin = format!("{driver} has a trouble: {}", option.get_name());
        let end = format!("{driver} has no trouble any more");
        add(rehearsed, &time, [begin, end], true);
        let motor = self.driver_trouble_motor as u8;
        board.trouble_driver(DriverTrouble { motor, trouble: name, time });
        Ok(())
    }
}

/// Returns the time from `begin`, seconds, for `length` seconds.
fn span(begin: f64, length: f64) -> Range<Micros> {
    let [begin, end] = [begin, begin + length].map(|time| Micros((time * 1e6) as u64));
    begin..end
}
