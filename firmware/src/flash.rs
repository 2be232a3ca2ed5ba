//! The stored configuration, in the last two sectors of the flash, and a test of the sector before
//! them.
//!
//! While the flash is written, the processor cannot read from it, and all interrupts wait. So it is
//! written at standstill only. The emergency input stops pulses and drivers without the processor.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_rp::Peri;
use embassy_rp::flash::{self, ERASE_SIZE, Flash};
use embassy_rp::peripherals::FLASH;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Timer;
use plumb_core::config_store::{ConfigStore, Stored};
use plumb_core::law::KnownRig;

use crate::chip::{ConfigFlash, FLASH_SIZE as SIZE};
use crate::{law_worker, watchdog};

/// Where the configuration is. The linker's memory leaves the last three sectors free.
const STORE: ConfigStore =
    ConfigStore([(SIZE - 2 * ERASE_SIZE) as u32, (SIZE - ERASE_SIZE) as u32]);

/// Sector that holds nothing, for the test.
const TESTED: u32 = (SIZE - 3 * ERASE_SIZE) as u32;
/// Bytes that the test writes at a time.
const PAGE: usize = 256;

#[allow(clippy::large_enum_variant, reason = "there is one at a time, and no heap for it")]
pub(crate) enum FlashWrite {
    /// A wiring and a configuration.
    Setup(Stored),
    /// A test of the sector that holds nothing.
    Test,
}

/// What to write.
static TO_WRITE: Signal<CriticalSectionRawMutex, FlashWrite> = Signal::new();

/// Result of the last write: [`NONE`], [`WRITTEN`] or [`FAILED`].
static RESULT: AtomicU8 = AtomicU8::new(NONE);
const NONE: u8 = 0;
const WRITTEN: u8 = 1;
const FAILED: u8 = 2;

/// Returns the stored wiring and configuration, and the flash.
pub(crate) fn open(flash: Peri<'static, FLASH>) -> (Option<Stored>, ConfigFlash) {
    let mut flash = Flash::new_blocking(flash);
    (STORE.load(&mut flash), flash)
}

/// Returns the rig that was stored with the configuration.
pub(crate) fn known_rig(flash: &mut ConfigFlash) -> Option<KnownRig> {
    STORE.known_rig(flash)
}

/// Requests a write. Called by the stepping interrupt; never waits.
pub(crate) fn write(wanted: FlashWrite) {
    TO_WRITE.signal(wanted);
}

/// Returns, once, whether the flash was written; `None` while it is not finished.
pub(crate) fn written() -> Option<bool> {
    match RESULT.load(Ordering::Relaxed) {
        NONE => None,
        result => {
            RESULT.store(NONE, Ordering::Relaxed);
            Some(result == WRITTEN)
        }
    }
}

/// Carries out the requested writes.
#[embassy_executor::task]
pub(crate) async fn write_requested(mut flash: ConfigFlash) {
    loop {
        let wanted = TO_WRITE.wait().await;
        watchdog::extend_timeout(true);
        // Until a tick has fed the watchdog with the extended timeout.
        Timer::after_millis(4).await;
        let is_written = match wanted {
            FlashWrite::Setup(setup) => {
                let known = law_worker::known_rig().await;
                STORE.save(&mut flash, &setup, known.as_ref()).is_ok()
            }
            FlashWrite::Test => test(&mut flash) == Ok(true),
        };
        watchdog::extend_timeout(false);
        RESULT.store(if is_written { WRITTEN } else { FAILED }, Ordering::Relaxed);
    }
}

/// Erases a sector, writes it, and returns whether it then holds what was written.
fn test(flash: &mut ConfigFlash) -> Result<bool, flash::Error> {
    flash.blocking_erase(TESTED, TESTED + ERASE_SIZE as u32)?;
    let mut holds = true;
    for at in (TESTED..TESTED + ERASE_SIZE as u32).step_by(PAGE) {
        let (mut page, mut read) = ([0; PAGE], [0; PAGE]);
        flash.blocking_read(at, &mut read)?;
        holds &= read == [0xff; PAGE];
        // Every bit is cleared in some page and kept in another.
        page.iter_mut().enumerate().for_each(|(i, byte)| *byte = (i as u32 ^ (at / 256)) as u8);
        flash.blocking_write(at, &page)?;
        flash.blocking_read(at, &mut read)?;
        holds &= read == page;
    }
    Ok(holds)
}
