//! Handlers and priorities of the peripherals' interrupts.

use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::{bind_interrupts, i2c, peripherals, pio, uart, usb};

bind_interrupts!(pub(crate) struct Interrupts {
    USBCTRL_IRQ => usb::InterruptHandler<peripherals::USB>;
    UART0_IRQ => uart::BufferedInterruptHandler<peripherals::UART0>;
    PIO0_IRQ_0 => pio::InterruptHandler<peripherals::PIO0>;
    I2C0_IRQ => i2c::InterruptHandler<peripherals::I2C0>;
});

/// Puts the peripherals' interrupts above the tasks and below the stepping interrupt.
pub(crate) fn set_priorities() {
    for interrupt in [
        interrupt::TIMER_IRQ_0,
        interrupt::USBCTRL_IRQ,
        interrupt::UART0_IRQ,
        interrupt::PIO0_IRQ_0,
        interrupt::I2C0_IRQ,
    ] {
        interrupt.set_priority(Priority::P2);
    }
}
