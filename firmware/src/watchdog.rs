//! The hardware watchdog. The stepping interrupt feeds it, but only as long as the tasks and thread
//! mode are alive too.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_rp::Peri;
use embassy_rp::gpio::{Level, Output};
use embassy_rp::peripherals::{PIN_25, WATCHDOG};
use embassy_rp::watchdog::Watchdog;
use embassy_time::{Duration, Timer};

use crate::stack;

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

/// Extends the timeout, or ends that, from the next check on.
pub(crate) fn extend_timeout(extended: bool) {
    EXTENDED.store(extended, Ordering::Relaxed);
}

/// Records that thread mode is alive.
pub(crate) fn thread_is_alive() {
    THREAD_ALIVE.store(true, Ordering::Relaxed);
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
pub(crate) async fn heartbeat(led: Peri<'static, PIN_25>) {
    let mut led = Output::new(led, Level::High);
    loop {
        for _ in 0..HEARTBEATS_PER_TOGGLE {
            TASKS_ALIVE.store(true, Ordering::Relaxed);
            stack::scan();
            Timer::after(HEARTBEAT).await;
        }
        led.toggle();
    }
}
