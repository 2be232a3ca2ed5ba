//! The line that lets current through the motors.
//!
//! Off, the pin is an input: a resistor on the wire then holds the line where the drivers are off, as it does while the
//! chip is in reset, has no program, or has lost its power.

use embassy_rp::Peri;
use embassy_rp::gpio::{Flex, Pull};
use embassy_rp::peripherals::PIN_14;

/// The enable line.
pub(crate) struct Enable {
    pin: Flex<'static>,
    on: bool,
}

impl Enable {
    /// The line, off.
    pub(crate) fn new(pin: Peri<'static, PIN_14>) -> Self {
        let mut pin = Flex::new(pin);
        pin.set_pull(Pull::None);
        pin.set_as_input();
        Self { pin, on: false }
    }

    /// Switches the drivers on or off. Drivers with STEP inputs are on where the line is low.
    pub(crate) fn set(&mut self, on: bool) {
        if on == self.on {
            return;
        }
        self.on = on;
        if on {
            self.pin.set_low();
            self.pin.set_as_output();
        } else {
            self.pin.set_as_input();
        }
    }
}
