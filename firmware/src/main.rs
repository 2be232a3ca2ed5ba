//! The board on a Raspberry Pi Pico: it gives [`plumb_core::Board`] the bytes and the time, and carries out what it
//! returns.
//!
//! ```text
//! USB, UART -> link -> INBOX -> stepping (every 200 µs, above all else) -> generator -> DMA -> PIO -> pulses
//!           <- link <- OUTBOX <-
//! ```
//! Whatever is outside of `stepping` runs in thread mode and may take its time.
#![no_std]
#![no_main]
#![deny(missing_docs)]

mod coils;
mod divide;
mod enable;
mod flash;
mod generator;
mod hats;
mod link;
mod pins;
mod restart;
mod stepping;
mod watch;

use coils::Coils;
use embassy_executor::{SpawnError, SpawnToken, Spawner};
use embassy_rp::{Peripherals, bind_interrupts, peripherals, pio, uart, usb};
use enable::Enable;
use generator::Generator;
use watch::Watch;

bind_interrupts!(struct Interrupts {
    USBCTRL_IRQ => usb::InterruptHandler<peripherals::USB>;
    UART0_IRQ => uart::BufferedInterruptHandler<peripherals::UART0>;
    PIO0_IRQ_0 => pio::InterruptHandler<peripherals::PIO0>;
});

/// Starts a task. Each is started once, for which there is always room.
fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    if let Ok(task) = task {
        spawner.spawn(task);
    }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let cause = restart::cause();
    let p: Peripherals = embassy_rp::init(embassy_rp::config::Config::default());
    let watch = Watch::start(p.WATCHDOG);
    let enable = Enable::new(p.PIN_14);
    let parts = generator::Parts {
        pio: p.PIO0,
        step: (p.PIN_2, p.PIN_4, p.PIN_6),
        direction: (p.PIN_3, p.PIN_5, p.PIN_7),
        emergency: p.PIN_15,
        channels: (p.DMA_CH0, p.DMA_CH1, p.DMA_CH2),
    };
    let generator = Generator::new(parts);
    let coils = Coils::new((p.PIN_8, p.PIN_9, p.PIN_10, p.PIN_11, p.PIN_12, p.PIN_13));
    let (kept, keeper) = flash::open(p.FLASH);
    let inbox = link::start(spawner, link::Parts { usb: p.USB, uart: p.UART0, tx: p.PIN_0, rx: p.PIN_1 });
    spawn(spawner, watch::beat(p.PIN_25));
    spawn(spawner, flash::keep(keeper));
    spawn(spawner, hats::follow(hats::Parts { bus: p.I2C0, data: p.PIN_16, clock: p.PIN_17 }));
    stepping::start(stepping::Parts { inbox, generator, coils, enable, watch, cause, kept });
}
