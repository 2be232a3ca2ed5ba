//! The stored configuration, in the last two sectors of the flash.
//!
//! While the flash is written, the processor cannot read from it, and all interrupts wait. So it is
//! written at standstill only. The emergency input stops pulses and drivers without the processor.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_rp::Peri;
use embassy_rp::flash::{Blocking, ERASE_SIZE, Flash};
use embassy_rp::peripherals::FLASH;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Timer;
use plumb_core::config_store::ConfigStore;
use plumb_protocol::Config;

use crate::watchdog;

/// Size of a Pico's flash, bytes. memory.x leaves the last two sectors free.
const SIZE: usize = 2 * 1024 * 1024;
const STORE: ConfigStore =
    ConfigStore([(SIZE - 2 * ERASE_SIZE) as u32, (SIZE - ERASE_SIZE) as u32]);

/// The flash driver.
pub(crate) type ConfigFlash = Flash<'static, FLASH, Blocking, SIZE>;

/// The configuration to write.
static TO_WRITE: Signal<CriticalSectionRawMutex, Config> = Signal::new();

/// Result of the last write: [`NONE`], [`WRITTEN`] or [`FAILED`].
static RESULT: AtomicU8 = AtomicU8::new(NONE);
const NONE: u8 = 0;
const WRITTEN: u8 = 1;
const FAILED: u8 = 2;

/// Returns the stored configuration, and the flash.
pub(crate) fn open(flash: Peri<'static, FLASH>) -> (Option<Config>, ConfigFlash) {
    let mut flash = Flash::new_blocking(flash);
    (STORE.load(&mut flash), flash)
}

/// Returns the unique number of the flash chip (W25Q16JV, instruction 4Bh), which is the board's.
/// Call it before anything else runs: the flash is not readable meanwhile.
pub(crate) fn unique_id(flash: &mut ConfigFlash) -> Option<[u8; 8]> {
    let mut id = [0; 8];
    flash.blocking_unique_id(&mut id).ok().map(|()| id)
}

/// Requests that a configuration is written. Called by the stepping interrupt; never waits.
pub(crate) fn write(config: &Config) {
    TO_WRITE.signal(*config);
}

/// Returns, once, whether the configuration was written; `None` while it is not finished.
pub(crate) fn written() -> Option<bool> {
    match RESULT.load(Ordering::Relaxed) {
        NONE => None,
        result => {
            RESULT.store(NONE, Ordering::Relaxed);
            Some(result == WRITTEN)
        }
    }
}

/// Writes the requested configurations.
#[embassy_executor::task]
pub(crate) async fn write_configs(mut flash: ConfigFlash) {
    loop {
        let config = TO_WRITE.wait().await;
        watchdog::extend_timeout(true);
        // Until a tick has fed the watchdog with the extended timeout.
        Timer::after_millis(4).await;
        let result = STORE.save(&mut flash, &config);
        watchdog::extend_timeout(false);
        RESULT.store(if result.is_ok() { WRITTEN } else { FAILED }, Ordering::Relaxed);
    }
}
