//! The line that lets current through the motors.
//!
//! Off, the pin is an input: a resistor on the wire then holds the line where the drivers are off,
//! as it does while the chip is in reset, has no program, or has lost its power.

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
    /// The line, off.
    pub(crate) fn new(pin: Peri<'static, PIN_14>) -> Self {
        let mut pin = Flex::new(pin);
        pin.set_pull(Pull::None);
        pin.set_as_input();
        Self { pin, on: false, active: Level::Low }
    }

    /// Which level lets the drivers work: low for those with STEP inputs, high for bridges.
    pub(crate) fn active(&mut self, level: Level) {
        self.active = level;
    }

    /// Whether the drivers are on.
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
