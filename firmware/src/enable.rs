//! The enable line of the motor drivers.
//!
//! While the drivers are off, the pin is an input, and a resistor on the wire holds the line at the
//! off level. The same holds while the chip is in reset or has no program. docs/use/board.md
//! computes the resistor, and says what is off without the chip's supply.
//!
//! Two must agree for the drivers to be on: the processor connects the pin to PIO0, and the monitor
//! of the emergency input ([`crate::generator`]) makes it an output there. Either switches them off
//! without the other.

use embassy_rp::gpio::{Level, Pull};
use embassy_rp::pac;
use embassy_rp::pac::io::vals::Outover;
use embassy_rp::peripherals::PIO0;
use embassy_rp::pio::Pin;

use crate::pins;

/// Pin function PIO0 (RP2040 datasheet, section 2.19.2).
const PIO: u8 = 6;
/// No pin function: the output is off.
const NONE: u8 = 31;

/// The enable line.
pub(crate) struct Enable {
    pin: Pin<'static, PIO0>,
    on: bool,
    active: Level,
}

impl Enable {
    /// Sets up the line, with the drivers off.
    pub(crate) fn new(mut pin: Pin<'static, PIO0>) -> Self {
        release();
        pin.set_pull(Pull::None);
        Self { pin, on: false, active: Level::Low }
    }

    /// Returns the pin, for the monitor of the emergency input.
    pub(crate) fn pin(&self) -> &Pin<'static, PIO0> {
        &self.pin
    }

    /// Sets the active level: low for drivers with STEP inputs, high for bridges.
    pub(crate) fn set_active_level(&mut self, level: Level) {
        self.active = level;
    }

    /// Returns whether the processor has switched the drivers on.
    pub(crate) fn is_on(&self) -> bool {
        self.on
    }

    /// Switches the drivers on or off.
    pub(crate) fn set(&mut self, on: bool) {
        if on == self.on {
            return;
        }
        self.on = on;
        if on {
            pac::IO_BANK0.gpio(pins::ENABLE.into()).ctrl().write(|w| {
                w.set_funcsel(PIO);
                // The level does not come from the PIO: it drives the pin low or high.
                w.set_outover(match self.active {
                    Level::Low => Outover::LOW,
                    Level::High => Outover::HIGH,
                });
            });
        } else {
            release();
        }
    }
}

/// Switches the drivers off.
#[inline(always)]
pub(crate) fn release() {
    pac::IO_BANK0.gpio(pins::ENABLE.into()).ctrl().write(|w| w.set_funcsel(NONE));
}
