//! Restart after a panic or a fault, in a safe state, and the cause of the last start.
//!
//! Scratch registers of the watchdog keep the cause over a restart, and the place of a panic; only
//! a loss of power clears them.

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_rp::{pac, rom_data};
use plumb_protocol::message::StartCause;
use plumb_protocol::panic_place;

use crate::enable;

/// Scratch register after a panic.
const PANIC: u32 = 0x504c_0001;
/// Scratch register after a fault of the processor.
const HARD_FAULT: u32 = 0x504c_0002;

/// Returns the cause of the start, and clears the scratch register.
pub(crate) fn cause() -> StartCause {
    let kept = pac::WATCHDOG.scratch0().read();
    pac::WATCHDOG.scratch0().write_value(0);
    let reason = pac::WATCHDOG.reason().read();
    match kept {
        PANIC => StartCause::Panic(pac::WATCHDOG.scratch1().read()),
        HARD_FAULT => StartCause::HardFault,
        _ if reason.timer() => StartCause::Watchdog,
        _ if reason.force() => StartCause::Requested,
        _ if pac::VREG_AND_CHIP_RESET.chip_reset().read().had_run() => StartCause::ResetPin,
        _ => StartCause::PowerOn,
    }
}

/// Stops the pulses, and switches the drivers off.
fn make_safe() {
    cortex_m::interrupt::disable();
    pac::PIO0.ctrl().write(|_| {});
    enable::release();
}

/// Restarts the chip, and keeps the reason.
fn restart(reason: u32) -> ! {
    make_safe();
    pac::WATCHDOG.scratch0().write_value(reason);
    // Reset everything but the oscillators, as the HAL's watchdog does.
    pac::PSM.wdsel().write_value(pac::psm::regs::Wdsel(0x0001_fffc));
    loop {
        pac::WATCHDOG.ctrl().write(|w| w.set_trigger(true));
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    make_safe();
    let place = info.location().map_or(0, |place| panic_place(place.file(), place.line()));
    pac::WATCHDOG.scratch1().write_value(place);
    restart(PANIC)
}

// SAFETY: the handler uses no content of the stack and no variables.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    restart(HARD_FAULT)
}

/// Starts the chip's bootloader, which takes a new firmware over USB.
pub(crate) fn bootloader() -> ! {
    make_safe();
    rom_data::reset_to_usb_boot(0, 0);
    restart(0)
}
