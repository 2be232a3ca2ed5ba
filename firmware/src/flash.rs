//! The configuration in the last two sectors of the flash.
//!
//! While the flash is written the processor can read nothing from it, and all interrupts wait: that
//! is only done at standstill. The emergency input needs no processor.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_rp::Peri;
use embassy_rp::flash::{Blocking, ERASE_SIZE, Flash};
use embassy_rp::peripherals::FLASH;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Timer;
use plumb_core::config_store::ConfigStore;
use plumb_protocol::Config;

use crate::watch;

/// A Pico has 2 MiB. memory.x leaves the last two sectors free.
const SIZE: usize = 2 * 1024 * 1024;
const STORE: ConfigStore =
    ConfigStore([(SIZE - 2 * ERASE_SIZE) as u32, (SIZE - ERASE_SIZE) as u32]);

/// The flash, for writing.
pub(crate) type Keeper = Flash<'static, FLASH, Blocking, SIZE>;

static TO_WRITE: Signal<CriticalSectionRawMutex, Config> = Signal::new();

/// What has become of it: 0 nothing yet, otherwise [`WRITTEN`] or [`FAILED`].
static RESULT: AtomicU8 = AtomicU8::new(0);
const WRITTEN: u8 = 1;
const FAILED: u8 = 2;

/// What was kept, and the flash to keep more.
pub(crate) fn open(flash: Peri<'static, FLASH>) -> (Option<Config>, Keeper) {
    let mut flash = Flash::new_blocking(flash);
    (STORE.load(&mut flash), flash)
}

/// Has a configuration written. For the stepping: never waits.
pub(crate) fn write(config: &Config) {
    TO_WRITE.signal(*config);
}

/// Whether it was written; `None` while it still is. Tells it once.
pub(crate) fn written() -> Option<bool> {
    match RESULT.load(Ordering::Relaxed) {
        0 => None,
        result => {
            RESULT.store(0, Ordering::Relaxed);
            Some(result == WRITTEN)
        }
    }
}

/// Writes what it is given.
#[embassy_executor::task]
pub(crate) async fn keep(mut flash: Keeper) {
    loop {
        let config = TO_WRITE.wait().await;
        watch::be_lenient(true);
        // Until the watchdog has been fed accordingly.
        Timer::after_millis(4).await;
        let result = STORE.save(&mut flash, &config);
        watch::be_lenient(false);
        RESULT.store(if result.is_ok() { WRITTEN } else { FAILED }, Ordering::Relaxed);
    }
}
