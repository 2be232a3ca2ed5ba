//! Options of `plumb emulate` for what goes wrong by plan: a rehearsal.

use std::ops::Range;

use clap::Args;
use plumb_protocol::units::Micros;
use plumb_sim::emulator::EmulatedBoard;

use crate::commands::numbers;

/// What goes wrong with the emulated board.
#[derive(Args)]
#[command(next_help_heading = "A rehearsal")]
pub(super) struct RehearsalOptions {
    /// Time after which the emergency button is pressed for 3 s, above 0, to 1e9 s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    #[arg(value_parser = numbers::within(numbers::TIME))]
    emergency_after: Option<f64>,
}

/// Time for which the emergency button is pressed, seconds.
const PRESS_S: f64 = 3.0;

impl RehearsalOptions {
    /// Plans for `board` what the options say.
    pub(super) fn plan(&self, board: &mut EmulatedBoard) {
        if let Some(seconds) = self.emergency_after {
            board.press_emergency_button(span(seconds, PRESS_S));
        }
    }
}

/// Returns the time from `begin`, seconds, for `length` seconds.
fn span(begin: f64, length: f64) -> Range<Micros> {
    let [begin, end] = [begin, begin + length].map(|time| Micros((time * 1e6) as u64));
    begin..end
}
