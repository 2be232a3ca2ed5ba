//! The ENABLE lines of the motor drivers.
//!
//! Without a configuration, and while the chip is in reset or has no program, the pins are inputs:
//! resistors on the wires decide. docs/use/board.md computes them, and says what is off without the
//! chip's supply. With a configuration the pins drive the off level while the drivers are off.
//!
//! Two must agree for the drivers to be on: the processor connects the pins to PIO0, and the
//! monitor of the emergency input ([`crate::generator`]) makes them outputs there, all at once.
//! Either switches the drivers off without the other. An opto-coupler whose current switches the
//! motors off is the other way round: its pin gives that current unless both agree, so that
//! OEOVER inverts what the monitor does.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::pac;
use embassy_rp::pac::io::regs::GpioCtrl as Ctrl;
use embassy_rp::pac::io::vals::{Oeover, Outover};
use plumb_protocol::boards::PIN_COUNT;
use plumb_protocol::wiring::{EnablePolarity, Pins};

use crate::pins::{self, Pull, constant, control, function};

/// Pins of ENABLE, a bit each; none without a configuration.
static PINS: AtomicU32 = AtomicU32::new(0);
/// Register of a pin while the drivers are off.
static OFF: AtomicU32 = AtomicU32::new(0);

/// The ENABLE lines.
pub(crate) struct Enable {
    on: bool,
    /// Register of a pin while the drivers are on.
    control: Ctrl,
}

impl Enable {
    /// Creates the lines of a board without a configuration.
    pub(crate) const fn new() -> Self {
        Self { on: false, control: Ctrl(0) }
    }

    /// Changes to other pins, whose drivers are off.
    #[cold]
    pub(crate) fn connect(&mut self, wired: &Pins) {
        let (on, off_level) = match wired.polarity {
            EnablePolarity::ActiveLow => (driven(false), true),
            EnablePolarity::ActiveHigh => (driven(true), false),
            EnablePolarity::OptoOffHigh => (without_current(true), true),
            EnablePolarity::OptoOffLow => (without_current(false), false),
        };
        // The pull helps where a pin is let go: to off, but to no current of an opto-coupler.
        let has_opto =
            matches!(wired.polarity, EnablePolarity::OptoOffHigh | EnablePolarity::OptoOffLow);
        let pull = if off_level != has_opto { Pull::Up } else { Pull::Down };
        let numbers = wired.enable.numbers();
        numbers.iter().for_each(|pin| pins::set_pad(*pin, pull, false));
        (self.on, self.control) = (false, on);
        OFF.store(constant(off_level).0, Ordering::Relaxed);
        PINS.store(numbers.iter().fold(0, |mask, pin| mask | 1 << pin), Ordering::Relaxed);
        switch_off();
    }

    /// Forgets the pins, which are inputs again.
    #[cold]
    pub(crate) fn disconnect(&mut self) {
        switch_off();
        self.on = false;
        PINS.store(0, Ordering::Relaxed);
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
            set_all(self.control);
        } else {
            switch_off();
        }
    }
}

/// Returns the register of a pin that gives this level while the monitor makes it an output.
fn driven(level: bool) -> Ctrl {
    let mut control = control(function::PIO0);
    // The level does not come from the PIO.
    control.set_outover(if level { Outover::HIGH } else { Outover::LOW });
    control
}

/// Returns the register of a pin that gives no current while the monitor makes it an output, and
/// this level otherwise.
fn without_current(level: bool) -> Ctrl {
    let mut control = driven(level);
    control.set_oeover(Oeover::INVERT);
    control
}

/// Switches the drivers off.
#[inline(always)]
pub(crate) fn switch_off() {
    set_all(Ctrl(OFF.load(Ordering::Relaxed)));
}

/// Sets the register of every pin.
#[inline(always)]
fn set_all(control: Ctrl) {
    let mut left = PINS.load(Ordering::Relaxed);
    for pin in 0..PIN_COUNT {
        if left == 0 {
            break;
        }
        if left & 1 != 0 {
            pac::IO_BANK0.gpio(pin.into()).ctrl().write_value(control);
        }
        left >>= 1;
    }
}
