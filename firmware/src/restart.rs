//! Restart after a panic or a fault, in a safe state, and the cause of the last start.
//!
//! What the chip leaves of each cause, in the order in which [`cause`] tells them apart. REASON is
//! the watchdog's register, CHIP_RESET that of the chip-level resets. "=" is unchanged.
//!
//! | start after | REASON | CHIP_RESET | scratch 0, 1 | 2, 3 | scratch 4 | memory | peripherals |
//! |---|---|---|---|---|---|---|---|
//! | a debugger's reset of the processor | = | = | = | = | = | = | = |
//! | panic | force | = | [`PANIC`], place | = | [`ARMED`] | = | reset |
//! | fault of the processor | force | = | [`HARD_FAULT`], = | PC, LR | [`ARMED`] | = | reset |
//! | stack overflow | force | = | [`HARD_FAULT`], = | 0, 0 | [`ARMED`] | = | reset |
//! | expiry of the watchdog | timer | = | 0, = | = | [`ARMED`] | = | reset |
//! | UF2 or PICOBOOT, button or command | timer | = | = or 0, 0 | = | 0 | download | reset |
//! | rescue by a debugger | 0 | PSM_RESTART | 0 | 0 | 0 | = | reset |
//! | RUN pin | 0 | RUN | 0 | 0 | 0 | not promised | reset |
//! | power on, brown-out | 0 | POR | 0 | 0 | 0 | lost | reset |
//!
//! - Every start from flash overwrites the last 256 bytes of memory with the second boot stage
//!   (pico-bootrom-rp2040, `bootrom_main.c`: `BOOT2_BASE`); nothing of this program is there.
//! - The boot ROM restarts the chip through the watchdog's timer after a download, and clears
//!   scratch 4 (`runtime.c`: `watchdog_reboot`). So this program leaves a number there, the one of
//!   the SDK's `watchdog_enable` (hardware_watchdog/watchdog.c).
//! - The command to enter the bootloader goes through the watchdog's timer too. The ROM keeps its
//!   arguments in scratch 0 and 1 and an address in scratch 4 to 7, and clears scratch 4 when it
//!   jumps there (`bootrom_main.c`: `reset_usb_boot`, `bootrom_rt0.S`: `check_wdog`).
//! - Scratch 5 says whether Motor HATs are configured ([`keep_hats`]). The bootloader overwrites
//!   it.
//! - The watchdog and its registers are reset by power, brown-out and the RUN pin alone (RP2040
//!   datasheet, sections 4.7.1 and 4.7.4). CHIP_RESET does not tell a brown-out from power on
//!   (section 2.12.7).
//! - An RP2350 has CHIP_RESET in POWMAN, with the source of the last reset: a brown-out is told
//!   apart ([`chip::reset_cause`]). A debugger's reset of a processor clears REASON there (RP2350
//!   datasheet, section 12.9.7).
//! - A debugger's reset of the processor keeps all registers (section 2.4.2.9). It is known by
//!   PIO0, which every other reset holds in reset until this program releases it.
//!
//! - A stack overflow is an access below RAM, which the guard refuses ([`crate::stack`]). The
//!   processor cannot save its registers there either; it still enters the handler of the fault,
//!   which gives itself the whole stack anew. A processor that locks up instead is restarted by the
//!   watchdog, and the cause is then the watchdog's.
//!
//! Only silicon can tell what is left of memory after the RUN pin, what a rescue leaves, and
//! whether a stack overflow locks the processor up.

use core::arch::global_asm;
use core::panic::PanicInfo;

use embassy_rp::{pac, rom_data};
use plumb_protocol::diagnostics::ProcessorFault;
use plumb_protocol::message::StartCause;
use plumb_protocol::panic_place;

use crate::{chip, diagnostics, enable, watchdog};

/// Scratch register 4 while this program runs: the number of the SDK's `watchdog_enable`.
const ARMED: u32 = 0x6ab7_3121;
/// Scratch register 0 after a panic.
const PANIC: u32 = 0x504c_0001;
/// Scratch register 0 after a fault of the processor.
const HARD_FAULT: u32 = 0x504c_0002;
/// Scratch register 5 while Motor HATs are configured.
const HATS: u32 = 0x504c_0003;

/// Returns whether Motor HATs were configured when the chip restarted: they may have current. The
/// watchdog's registers keep that, but not over a loss of power or the RUN pin.
pub(crate) fn hats_were_configured() -> bool {
    pac::WATCHDOG.scratch5().read() == HATS
}

/// Keeps over a restart whether Motor HATs are configured.
#[cold]
pub(crate) fn keep_hats(are_configured: bool) {
    pac::WATCHDOG.scratch5().write_value(if are_configured { HATS } else { 0 });
}

/// Returns the cause of the start, and prepares the scratch registers for the next one.
///
/// Call it once, before the peripherals are set up.
pub(crate) fn cause() -> StartCause {
    let armed = pac::WATCHDOG.scratch4().read() == ARMED;
    let kept = pac::WATCHDOG.scratch0().read();
    pac::WATCHDOG.scratch0().write_value(0);
    pac::WATCHDOG.scratch4().write_value(ARMED);
    let reason = pac::WATCHDOG.reason().read();
    let processor_alone = !pac::RESETS.reset().read().pio0();
    match kept {
        _ if processor_alone => StartCause::Requested,
        PANIC if armed => StartCause::Panic(pac::WATCHDOG.scratch1().read()),
        HARD_FAULT if armed => {
            let [pc, lr] = [pac::WATCHDOG.scratch2(), pac::WATCHDOG.scratch3()].map(|r| r.read());
            diagnostics::set_last_fault(ProcessorFault { pc, lr });
            StartCause::HardFault
        }
        _ if reason.timer() && armed => StartCause::Watchdog,
        _ if reason.timer() || reason.force() => StartCause::Requested,
        _ => chip::reset_cause(),
    }
}

/// Stops the pulses, and switches the drivers off.
fn make_safe() {
    cortex_m::interrupt::disable();
    pac::PIO0.ctrl().write(|_| {});
    enable::switch_off();
}

/// Restarts the chip, and keeps the reason.
fn restart(reason: u32) -> ! {
    make_safe();
    pac::WATCHDOG.scratch0().write_value(reason);
    watchdog::reset_everything();
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

// The handler of a fault, named as in the table of the vectors. It needs no stack: it reads PC and
// LR from the frame that the processor has pushed, if all of it lies within the stack above its
// lowest word, where an RP2350 leaves the pointer after an overflow without a frame, and lets
// `on_hard_fault` begin with an empty one.
global_asm!(
    ".section .HardFaultTrampoline, \"ax\"",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "movs r0, #0",
    "movs r1, #0",
    "mov r2, sp",
    "ldr r3, =_stack_end",
    "cmp r2, r3",
    "bls 1f",
    "ldr r3, =_stack_start",
    "subs r3, #32",
    "cmp r2, r3",
    "bhi 1f",
    "ldr r0, [r2, #24]",
    "ldr r1, [r2, #20]",
    "1:",
    "ldr r3, =_stack_start",
    "mov sp, r3",
    "bl {on_hard_fault}",
    ".pool",
    ".size HardFault, . - HardFault",
    ".text",
    on_hard_fault = sym on_hard_fault,
);

/// Keeps the registers of a fault, and restarts the chip.
extern "C" fn on_hard_fault(pc: u32, lr: u32) -> ! {
    pac::WATCHDOG.scratch2().write_value(pc);
    pac::WATCHDOG.scratch3().write_value(lr);
    restart(HARD_FAULT)
}

/// Starts the chip's bootloader, which takes a new firmware over USB. `pins` show its activity;
/// `disabled` has bit 0 to switch off its drive, bit 1 for picotool's interface (RP2040 datasheet,
/// section 2.8.3.1.5).
pub(crate) fn bootloader(pins: u32, disabled: u32) -> ! {
    make_safe();
    rom_data::reset_to_usb_boot(pins, disabled);
    restart(0)
}

/// Starts the program again.
pub(crate) fn program() -> ! {
    restart(0)
}
