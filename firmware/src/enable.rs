//! The enable line of the motor drivers.
//!
//! While the drivers are off, the pin is an input, and a resistor on the wire holds the line at the
//! off level. The same holds while the chip is in reset, has no program, or has no power.

use embassy_rp::Peri;
use embassy_rp::gpio::{Flex, Level, Pull};
use embassy_rp::peripherals::PIN_14;

/// The enable line.
pub(crate) struct Enable {
    pin: Flex<'static>,
    on: bool,
    active: Level,
}

impl Enable {
    /// Sets up the line, with the drivers off.
    pub(crate) fn new(pin: Peri<'static, PIN_14>) -> Self {
        let mut pin = Flex::new(pin);
        pin.set_pull(Pull::None);
        pin.set_as_input();
        Self { pin, on: false, active: Level::Low }
    }

    /// Sets the active level: low for drivers with STEP inputs, high for bridges.
    pub(crate) fn set_active_level(&mut self, level: Level) {
        self.active = level;
    }

    /// Returns whether the drivers are on.
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
            self.pin.set_level(self.active);
            self.pin.set_as_output();
        } else {
            self.pin.set_as_input();
        }
    }
}
