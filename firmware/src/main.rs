//! The board on a Raspberry Pi Pico or a Pico 2. It gives [`plumb_core::Board`] the bytes and the
//! time, and carries out what the board returns.
//!
//! ```text
//! USB, UART -> link -> inbox -> stepping (every 200 µs) -> generator -> DMA -> PIO -> pulses
//!           <- link <- outbox <-  |  ^
//!                         request v  | response
//!                            law_worker (thread mode)
//! ```
//!
//! Priorities, from the highest: the stepping interrupt; the peripherals' interrupts; the tasks of
//! links, flash, HATs, drivers on a UART and LED; thread mode, which runs the deferred laws.
#![no_std]
#![no_main]
#![deny(missing_docs)]

mod chip;
mod coils;
mod diagnostics;
mod enable;
mod flash;
mod generator;
mod hats;
mod info;
mod interrupts;
mod law_worker;
mod link;
mod pins;
mod restart;
#[cfg(not(feature = "rp2350"))]
mod run_time_abi;
mod stack;
mod stepping;
mod tmc2209;
mod watchdog;
mod witness;

use embassy_executor::Spawner;
use embassy_rp::Peripherals;
use embassy_rp::config::Config;

use coils::Coils;
use enable::Enable;
use generator::Generator;
use hats::HatResources;
use interrupts::spawn;
use link::LinkResources;
use stepping::SteppingResources;
use watchdog::TickWatchdog;

struct TaskResources {
    link: LinkResources,
    hats: HatResources,
    flash: chip::ConfigFlash,
}

#[embassy_executor::task]
async fn start_tasks(resources: TaskResources) {
    // SAFETY: the spawner stays in this task, which runs in the spawner's executor.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    link::start(spawner, resources.link);
    spawn(spawner, watchdog::heartbeat());
    spawn(spawner, flash::write_requested(resources.flash));
    spawn(spawner, hats::drive_hats(resources.hats));
    spawn(spawner, tmc2209::watch_drivers());
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let cause = restart::cause();
    chip::install_stack_guard();
    stack::fill();
    let p: Peripherals = embassy_rp::init(Config::new(chip::clocks()));
    interrupts::copy_vectors();
    interrupts::set_priorities();
    let watchdog = TickWatchdog::start(p.WATCHDOG);
    pins::release_all();
    watchdog::limit_led();
    let mut generator = Generator::new(p.PIO0, (p.DMA_CH0, p.DMA_CH1, p.DMA_CH2));
    let has_planned_clock = generator.has_planned_clock();
    let (coils, enable) = (Coils::new(), Enable::new());
    let (stored, mut flash) = flash::open(p.FLASH);
    let known = flash::known_rig(&mut flash);
    let id = chip::unique_id(&mut flash);
    let (inbox_writer, inbox) = link::inbox();
    let link = LinkResources {
        usb: p.USB,
        uart: p.UART0,
        tx: p.PIN_0,
        rx: p.PIN_1,
        inbox: inbox_writer,
        id,
    };
    let hats = HatResources {
        bus: p.I2C0,
        data: p.PIN_16,
        clock: p.PIN_17,
        were_configured: restart::hats_were_configured(),
    };
    let spawner = interrupts::start_executor();
    if let Ok(task) = start_tasks(TaskResources { link, hats, flash }) {
        spawner.spawn(task);
    }
    stepping::start(SteppingResources {
        inbox,
        generator,
        coils,
        enable,
        watchdog,
        has_planned_clock,
        cause,
        stored,
    });
    law_worker::run(known)
}
