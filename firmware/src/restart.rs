//! How the board ends, so that it begins again in a safe state, and why it began.
//!
//! The reason is kept over the restart in one of the watchdog's scratch registers, which only a
//! loss of power clears.

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_rp::{pac, rom_data};
use plumb_protocol::message::StartCause;

use crate::pins;

/// What is in the scratch register after a panic or a fault of the processor.
const PANIC: u32 = 0x504c_0001;
const HARD_FAULT: u32 = 0x504c_0002;

/// Why the board started, and clears it for the next time.
pub(crate) fn cause() -> StartCause {
    let kept = pac::WATCHDOG.scratch0().read();
    pac::WATCHDOG.scratch0().write_value(0);
    let reason = pac::WATCHDOG.reason().read();
    match kept {
        PANIC => StartCause::Panic,
        HARD_FAULT => StartCause::HardFault,
        _ if reason.timer() => StartCause::Watchdog,
        _ if reason.force() => StartCause::Requested,
        _ if pac::VREG_AND_CHIP_RESET.chip_reset().read().had_run() => StartCause::ResetPin,
        _ => StartCause::PowerOn,
    }
}

/// No more pulses, no current through the motors.
fn make_safe() {
    cortex_m::interrupt::disable();
    pac::PIO0.ctrl().write(|_| {});
    pac::SIO.gpio_oe(0).value_clr().write_value(1 << pins::ENABLE);
}

fn restart(reason: u32) -> ! {
    make_safe();
    pac::WATCHDOG.scratch0().write_value(reason);
    // Everything but the oscillators, as the HAL's watchdog does it.
    pac::PSM.wdsel().write_value(pac::psm::regs::Wdsel(0x0001_fffc));
    loop {
        pac::WATCHDOG.ctrl().write(|w| w.set_trigger(true));
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    restart(PANIC)
}

// SAFETY: the handler uses neither the stack's content nor any variable.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    restart(HARD_FAULT)
}

/// Into the chip's bootloader, which takes a new firmware over USB.
pub(crate) fn bootloader() -> ! {
    make_safe();
    rom_data::reset_to_usb_boot(0, 0);
    restart(0)
}
