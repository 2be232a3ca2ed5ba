//! The hardware watchdog: fed from the stepping interrupt, and only as long as tasks and thread
//! mode are alive too.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_rp::Peri;
use embassy_rp::gpio::{Level, Output};
use embassy_rp::peripherals::{PIN_25, WATCHDOG};
use embassy_rp::watchdog::Watchdog;
use embassy_time::{Duration, Timer};

/// The chip restarts when it was not fed for so long.
const BITE: Duration = Duration::from_millis(100);
/// The tasks show up this often; thread mode before each sleep, and after each question that it has
/// thought about.
const BEAT: Duration = Duration::from_millis(10);
/// They are given up after so many ticks without both: 100 ms, some times the longest thought.
const PATIENCE: u16 = 500;

/// The same while the flash is written, when nothing else runs: erasing a sector takes up to 0.4 s
/// (W25Q16JV, 9.6).
const LENIENT_BITE: Duration = Duration::from_millis(1000);

/// Looked after every so many ticks: 3.2 ms.
const EVERY: u32 = 16;

static TASKS_ALIVE: AtomicBool = AtomicBool::new(false);
static THREAD_ALIVE: AtomicBool = AtomicBool::new(false);
static LENIENT: AtomicBool = AtomicBool::new(false);

/// Lets the watchdog wait longer, from the next tick on.
pub(crate) fn be_lenient(lenient: bool) {
    LENIENT.store(lenient, Ordering::Relaxed);
}

/// Shows that thread mode is alive.
pub(crate) fn thread_is_alive() {
    THREAD_ALIVE.store(true, Ordering::Relaxed);
}

/// The watchdog, running.
pub(crate) struct Watch {
    watchdog: Watchdog,
    /// Ticks, which wrap; and those since both were there.
    ticks: u32,
    silent: u16,
}

impl Watch {
    /// Starts it.
    pub(crate) fn start(watchdog: Peri<'static, WATCHDOG>) -> Self {
        let mut watchdog = Watchdog::new(watchdog);
        watchdog.pause_on_debug(true);
        watchdog.start(BITE);
        Self { watchdog, ticks: 0, silent: 0 }
    }

    /// Feeds it, if tasks and thread mode have been there lately; every tick.
    #[inline(always)]
    pub(crate) fn tick(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
        if self.ticks.is_multiple_of(EVERY) {
            self.look();
        }
    }

    #[inline(never)]
    fn look(&mut self) {
        if TASKS_ALIVE.load(Ordering::Relaxed) && THREAD_ALIVE.load(Ordering::Relaxed) {
            TASKS_ALIVE.store(false, Ordering::Relaxed);
            THREAD_ALIVE.store(false, Ordering::Relaxed);
            self.silent = 0;
        } else {
            self.silent = self.silent.saturating_add(EVERY as u16);
        }
        if self.silent < PATIENCE {
            // Known at compile time, which `Watchdog::feed` makes a store of.
            if LENIENT.load(Ordering::Relaxed) {
                self.watchdog.feed(LENIENT_BITE);
            } else {
                self.watchdog.feed(BITE);
            }
        }
    }
}

/// Shows that the tasks are alive; to people by the lamp, which is on for half of every second.
#[embassy_executor::task]
pub(crate) async fn beat(lamp: Peri<'static, PIN_25>) {
    let mut lamp = Output::new(lamp, Level::High);
    loop {
        for _ in 0..50 {
            TASKS_ALIVE.store(true, Ordering::Relaxed);
            Timer::after(BEAT).await;
        }
        lamp.toggle();
    }
}
