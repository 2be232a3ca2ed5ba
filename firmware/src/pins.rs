//! The pins, which the wiring chooses at run time (`plumb_protocol::boards` has the table).
//!
//! Without a configuration every pin but those of the link and the LED is as the chip's reset
//! leaves it: an input with its pull-down, which no peripheral drives. A pin's function and its
//! overrides are one register (IO_BANK0's CTRL, RP2040 datasheet, section 2.19.2): OUTOVER and
//! OEOVER also make a constant level, and INOVER inverts what the peripherals see.
//!
//! A pin that two wirings in a row use is not an input between them. One that the next wiring does
//! not use becomes an input with the pull of its idle level, so that no driver sees a pulse.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::pac;
use embassy_rp::pac::io::regs::GpioCtrl as Ctrl;
use embassy_rp::pac::io::vals::{Inover, Oeover, Outover};
use plumb_protocol::boards::{Board, PICO, PIN_COUNT, UART};
use plumb_protocol::wiring::{Drivers, Pin, Pins, Wiring};

use crate::chip::{self, HAS_LATCHING_INPUTS};

/// UART0 from the host.
pub(crate) const UART_RX: u8 = UART[1];
/// LED of a board without a configuration.
pub(crate) const LED: Option<Pin> = PICO.pins.led;

/// Pins that the wiring in force uses, a bit each; at first the LED's.
static IN_USE: AtomicU32 = AtomicU32::new(match LED {
    Some(led) => 1 << led.number,
    None => 0,
});

/// Pin functions (RP2040 datasheet, section 2.19.2).
pub(crate) mod function {
    /// UART.
    pub(crate) const UART: u8 = 2;
    /// I2C.
    pub(crate) const I2C: u8 = 3;
    /// Pulse-width modulation.
    pub(crate) const PWM: u8 = 4;
    /// PIO0.
    pub(crate) const PIO0: u8 = 6;
    /// None: the pin is no output.
    pub(crate) const NONE: u8 = 31;
}

/// Pull of a pin.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pull {
    /// To ground, as after a reset.
    Down,
    /// To 3.3 V.
    Up,
}

/// Returns the register of a pin with this function and no overrides.
pub(crate) fn control(function: u8) -> Ctrl {
    let mut control = Ctrl(0);
    control.set_funcsel(function);
    control
}

/// Returns the register of a pin that is constant, whatever the peripherals do.
pub(crate) fn constant(level: bool) -> Ctrl {
    let mut control = control(function::NONE);
    control.set_outover(if level { Outover::HIGH } else { Outover::LOW });
    control.set_oeover(Oeover::ENABLE);
    control
}

/// Sets the register of a pin.
#[inline(always)]
pub(crate) fn set(pin: u8, control: Ctrl) {
    pac::IO_BANK0.gpio(pin.into()).ctrl().write_value(control);
}

/// Sets the pad of a pin: its output is on where a function drives it. An input that nothing reads
/// may be off: see [`HAS_LATCHING_INPUTS`].
pub(crate) fn set_pad(pin: u8, pull: Pull, is_read: bool) {
    pac::PADS_BANK0.gpio(pin.into()).modify(|w| {
        chip::connect_pad(w);
        w.set_ie(is_read || !HAS_LATCHING_INPUTS);
        w.set_od(false);
        w.set_pue(pull == Pull::Up);
        w.set_pde(pull == Pull::Down);
    });
}

/// Makes every pin but those of the link an input, with its pull-down.
#[cold]
pub(crate) fn release_all() {
    for pin in (0..PIN_COUNT).filter(|pin| !UART.contains(pin)) {
        set(pin, control(function::NONE));
        set_pad(pin, Pull::Down, false);
    }
}

/// Releases the pins of the last wiring that are not `used`: each becomes an input and keeps its
/// pull.
#[cold]
fn release_unused(used: u32) {
    // Only the stepping interrupt, which calls this, changes it.
    let unused = IN_USE.load(Ordering::Relaxed) & !used;
    IN_USE.store(used, Ordering::Relaxed);
    each(unused, |pin| {
        set(pin, control(function::NONE));
        pac::PADS_BANK0.gpio(pin.into()).modify(|w| w.set_ie(!HAS_LATCHING_INPUTS));
    });
}

/// Changes to the pins of a wiring. [`crate::enable`] drives ENABLE, and the heartbeat drives the
/// LED. No motor has current meanwhile.
#[cold]
pub(crate) fn connect(wiring: &Wiring) {
    let pins = &wiring.pins;
    for taken in Board::of(wiring.board).into_iter().flat_map(|board| board.taken) {
        if let Some(level) = taken.held {
            set(taken.number, constant(level));
        }
    }
    let mut emergency = control(function::NONE);
    emergency.set_inover(if pins.emergency.inverted { Inover::INVERT } else { Inover::NORMAL });
    set(pins.emergency.number, emergency);
    // A loop that is cut reads as open.
    let open = if pins.emergency.inverted { Pull::Down } else { Pull::Up };
    set_pad(pins.emergency.number, open, true);
    let others = pins.enable.numbers().iter().chain(pins.led.as_ref().map(|led| &led.number));
    let mut used = wiring.driver_pins() | 1 << pins.emergency.number;
    others.for_each(|pin| used |= 1 << pin);
    match wiring.drivers {
        Drivers::StepDir(_) => used |= connect_steps(pins),
        Drivers::Tmc2209(driver) => {
            used |= connect_steps(pins);
            for pin in driver.uart {
                used |= 1 << pin;
                set(pin, control(function::UART));
                // The line is idle while nothing drives it.
                set_pad(pin, Pull::Up, true);
            }
        }
        Drivers::Coils(_) => each(wiring.driver_pins(), |pin| {
            set_pad(pin, Pull::Down, false);
            set(pin, control(function::PWM));
        }),
        Drivers::MotorHats(_) => each(wiring.driver_pins(), |pin| {
            set(pin, control(function::I2C));
            set_pad(pin, Pull::Up, true);
        }),
    }
    release_unused(used);
    switch_off_unused(wiring, used);
}

/// Keeps the drivers of the board that no motor has without current. All boards with drivers of
/// their own switch them off by a high pin.
#[cold]
fn switch_off_unused(wiring: &Wiring, used: u32) {
    let board = Board::of(wiring.board).filter(|board| !board.has_free_drivers);
    let enables = board.map_or(&[][..], |board| board.pins.enable.numbers());
    for pin in enables.iter().filter(|pin| used >> **pin & 1 == 0) {
        set(*pin, constant(true));
    }
}

/// Connects STEP and DIR of the motors. Returns these pins, a bit each.
#[cold]
fn connect_steps(pins: &Pins) -> u32 {
    let mut used = 0;
    for motor in &pins.motors {
        used |= connect_step(motor.step) | connect_step(motor.direction);
    }
    used
}

/// Connects STEP or DIR of a motor, which the witness reads. Returns its bit.
#[cold]
#[inline(never)]
fn connect_step(pin: Pin) -> u32 {
    set_pad(pin.number, if pin.inverted { Pull::Up } else { Pull::Down }, true);
    set(pin.number, generated(pin));
    1 << pin.number
}

/// Returns the register of a pin of the step generator. The witness (PIO1) sees what the generator
/// gives, also at an inverted pin.
pub(crate) fn generated(pin: Pin) -> Ctrl {
    let mut control = control(function::PIO0);
    // The monitor of the emergency input changes the direction of every pin of PIO0.
    control.set_oeover(Oeover::ENABLE);
    if pin.inverted {
        control.set_outover(Outover::INVERT);
        control.set_inover(Inover::INVERT);
    }
    control
}

/// Calls `act` with each pin of a set of bits.
fn each(mut pins: u32, act: impl Fn(u8)) {
    while pins != 0 {
        act(pins.trailing_zeros() as u8);
        pins &= pins - 1;
    }
}
