//! The hardware watchdog. The stepping interrupt feeds it, but only as long as the tasks and thread
//! mode are alive too.

use core::sync::atomic::{AtomicBool, AtomicU16, Ordering};

use embassy_rp::pac::pads::vals::Drive;
use embassy_rp::peripherals::WATCHDOG;
use embassy_rp::watchdog::Watchdog;
use embassy_rp::{Peri, pac};
use embassy_time::{Duration, Timer};

use plumb_protocol::wiring::Pin;

use crate::{chip, pins, stack};

/// Time without feeding after which the chip restarts.
const TIMEOUT: Duration = Duration::from_millis(100);
/// The same while the flash is written and nothing else runs: erasing a sector takes up to 0.4 s
/// (W25Q16JV, section 9.6).
const EXTENDED_TIMEOUT: Duration = Duration::from_millis(1000);

/// Period of the tasks' sign of life. Thread mode gives its own before each sleep, and after each
/// response of a law.
const HEARTBEAT: Duration = Duration::from_millis(10);
/// Heartbeats in half a period of the LED: half a second.
const HEARTBEATS_PER_TOGGLE: u8 = 50;
/// Ticks without a sign of life of both after which the watchdog is no longer fed: 100 ms, several
/// times the longest update of a law.
const MAX_SILENT_TICKS: u16 = 500;

/// Ticks between two checks: 3.2 ms.
const CHECK_TICKS: u32 = 16;

static TASKS_ALIVE: AtomicBool = AtomicBool::new(false);
static THREAD_ALIVE: AtomicBool = AtomicBool::new(false);
static EXTENDED: AtomicBool = AtomicBool::new(false);

/// Pin of the LED, as [`packed`].
static LED: AtomicU16 = AtomicU16::new(packed(pins::LED));
/// No LED.
const NO_LED: u16 = u16::MAX;

/// Packs a pin: its number, and from bit 8 on whether it is inverted.
const fn packed(led: Option<Pin>) -> u16 {
    match led {
        Some(pin) => pin.number as u16 | (pin.inverted as u16) << 8,
        None => NO_LED,
    }
}

/// Sets the pin of the LED. Called by the stepping interrupt.
#[cold]
pub(crate) fn set_led(led: Option<Pin>) {
    LED.store(packed(led), Ordering::Relaxed);
}

/// Limits the current of the LED that is on without a configuration: on a board that has an input
/// there, a switch may connect it to ground.
pub(crate) fn limit_led() {
    if let Some(pin) = pins::LED {
        pac::PADS_BANK0.gpio(pin.number.into()).modify(|w| w.set_drive(Drive::_2M_A));
    }
}

/// Switches the LED on or off. The stepping interrupt may give its pin to something else, but not
/// meanwhile.
#[inline(never)]
fn show_led(is_on: bool) {
    critical_section::with(|_| {
        let led = LED.load(Ordering::Relaxed);
        if led != NO_LED {
            pins::set(led as u8, pins::constant(is_on != (led >> 8 != 0)));
        }
    });
}

/// Extends the timeout, or ends that, from the next check on.
pub(crate) fn extend_timeout(extended: bool) {
    EXTENDED.store(extended, Ordering::Relaxed);
}

/// Records that thread mode is alive.
pub(crate) fn thread_is_alive() {
    THREAD_ALIVE.store(true, Ordering::Relaxed);
}

/// Has the watchdog reset everything but the oscillators.
pub(crate) fn reset_everything() {
    pac::PSM.wdsel().write_value(pac::psm::regs::Wdsel(chip::RESET_ALL));
}

/// The running watchdog, fed by ticks.
pub(crate) struct TickWatchdog {
    watchdog: Watchdog,
    /// Ticks; wraps.
    ticks: u32,
    /// Ticks since both signs of life.
    silent: u16,
}

impl TickWatchdog {
    /// Starts the watchdog.
    pub(crate) fn start(watchdog: Peri<'static, WATCHDOG>) -> Self {
        let mut watchdog = Watchdog::new(watchdog);
        watchdog.pause_on_debug(true);
        watchdog.start(TIMEOUT);
        reset_everything();
        Self { watchdog, ticks: 0, silent: 0 }
    }

    /// Counts a tick, and checks when that is due.
    #[inline(always)]
    pub(crate) fn tick(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
        if self.ticks.is_multiple_of(CHECK_TICKS) {
            self.check();
        }
    }

    /// Returns whether this is a tick with a check.
    #[inline(always)]
    pub(crate) fn has_checked(&self) -> bool {
        self.ticks.is_multiple_of(CHECK_TICKS)
    }

    /// Feeds the watchdog, if tasks and thread mode have been alive lately.
    #[inline(never)]
    fn check(&mut self) {
        if TASKS_ALIVE.load(Ordering::Relaxed) && THREAD_ALIVE.load(Ordering::Relaxed) {
            TASKS_ALIVE.store(false, Ordering::Relaxed);
            THREAD_ALIVE.store(false, Ordering::Relaxed);
            self.silent = 0;
        } else {
            self.silent = self.silent.saturating_add(CHECK_TICKS as u16);
        }
        if self.silent < MAX_SILENT_TICKS {
            // With a constant timeout, `Watchdog::feed` is a single store.
            if EXTENDED.load(Ordering::Relaxed) {
                self.watchdog.feed(EXTENDED_TIMEOUT);
            } else {
                self.watchdog.feed(TIMEOUT);
            }
        }
    }
}

/// Gives the tasks' sign of life, looks for a deeper stack, and blinks the LED: it is on for half
/// of every second.
#[embassy_executor::task]
pub(crate) async fn heartbeat() {
    let mut is_on = true;
    loop {
        show_led(is_on);
        is_on = !is_on;
        for _ in 0..HEARTBEATS_PER_TOGGLE {
            TASKS_ALIVE.store(true, Ordering::Relaxed);
            stack::scan();
            Timer::after(HEARTBEAT).await;
        }
    }
}
