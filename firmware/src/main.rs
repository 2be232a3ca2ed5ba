//! The board on a Raspberry Pi Pico: it gives [`plumb_core::Board`] the bytes and the time, and
//! carries out what it returns.
//!
//! ```text
//! USB, UART -> link -> INBOX -> stepping (every 200 µs, above all else) -> generator -> DMA -> PIO -> pulses
//!           <- link <- OUTBOX <-  |  ^
//!                         REQUEST v  | RESPONSE
//!                              law_worker (below all else)
//! ```
//! By priority: stepping; the peripherals' interrupts; the tasks of links, flash, HATs and lamp;
//! thread mode, which thinks.
#![no_std]
#![no_main]
#![deny(missing_docs)]

mod coils;
mod divide;
mod enable;
mod flash;
mod float;
mod generator;
mod hats;
mod law_worker;
mod link;
mod pins;
mod restart;
mod stepping;
mod watch;

use coils::Coils;
use embassy_executor::{InterruptExecutor, SpawnError, SpawnToken, Spawner};
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::peripherals::PIN_25;
use embassy_rp::{Peri, Peripherals, bind_interrupts, i2c, peripherals, pio, uart, usb};
use enable::Enable;
use generator::Generator;
use watch::Watch;

bind_interrupts!(struct Interrupts {
    USBCTRL_IRQ => usb::InterruptHandler<peripherals::USB>;
    UART0_IRQ => uart::BufferedInterruptHandler<peripherals::UART0>;
    PIO0_IRQ_0 => pio::InterruptHandler<peripherals::PIO0>;
    I2C0_IRQ => i2c::InterruptHandler<peripherals::I2C0>;
});

/// Starts a task. Each is started once, for which there is always room.
fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    if let Ok(task) = task {
        spawner.spawn(task);
    }
}

/// Runs the tasks, above thread mode and below all other interrupts.
static TASKS: InterruptExecutor = InterruptExecutor::new();

#[embassy_rp::interrupt]
fn SWI_IRQ_1() {
    // SAFETY: this is the interrupt that the executor was started with, and nothing else calls it.
    unsafe { TASKS.on_interrupt() }
}

/// What the tasks work with.
struct Work {
    links: link::Parts,
    hats: hats::Parts,
    keeper: flash::Keeper,
    lamp: Peri<'static, PIN_25>,
}

/// Starts the others.
#[embassy_executor::task]
async fn begin(work: Work) {
    // SAFETY: it is used here alone, in the executor that it is of.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    link::start(spawner, work.links);
    spawn(spawner, watch::beat(work.lamp));
    spawn(spawner, flash::keep(work.keeper));
    spawn(spawner, hats::follow(work.hats));
}

/// Who goes before whom, but for the stepping.
fn set_priorities() {
    for above in [
        interrupt::TIMER_IRQ_0,
        interrupt::USBCTRL_IRQ,
        interrupt::UART0_IRQ,
        interrupt::PIO0_IRQ_0,
        interrupt::I2C0_IRQ,
    ] {
        above.set_priority(Priority::P2);
    }
    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let cause = restart::cause();
    let p: Peripherals = embassy_rp::init(embassy_rp::config::Config::default());
    set_priorities();
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
    let (to_board, inbox) = link::queue();
    let work = Work {
        links: link::Parts { usb: p.USB, uart: p.UART0, tx: p.PIN_0, rx: p.PIN_1, to_board },
        hats: hats::Parts { bus: p.I2C0, data: p.PIN_16, clock: p.PIN_17 },
        keeper,
        lamp: p.PIN_25,
    };
    let tasks = TASKS.start(interrupt::SWI_IRQ_1);
    if let Ok(begin) = begin(work) {
        tasks.spawn(begin);
    }
    stepping::start(stepping::Parts { inbox, generator, coils, enable, watch, cause, kept });
    law_worker::run()
}
