//! The RP2040 of a Raspberry Pi Pico and of an SKR Pico: two Cortex-M0+, 125 MHz.

use core::ffi::CStr;

use cortex_m::peripheral::MPU;
use embassy_rp::clocks::PllConfig;
use embassy_rp::flash::{Blocking, Flash};
use embassy_rp::peripherals::FLASH;
use embassy_rp::{pac, rom_data};
use plumb_core::law::LawTicks;
use plumb_protocol::boards::Chip;
use plumb_protocol::message::StartCause;
use plumb_protocol::provenance::BoardKind;

pub(crate) use embassy_rp::interrupt::{TIMER_IRQ_0 as TIME_DRIVER, TIMER_IRQ_1 as STEPPING};

/// The chip.
pub(crate) const CHIP: Chip = Chip::Rp2040;
/// Kind of board that the firmware calls itself.
pub(crate) const BOARD: BoardKind = BoardKind::Pico;
/// The board's name for picotool.
pub(crate) const PICO_BOARD: &CStr = c"pico";
/// Product id of a Pico's serial port on USB, which Raspberry Pi lets anyone use
/// (raspberrypi/usb-pid).
pub(crate) const USB_PRODUCT: u16 = 0x000a;
/// The system's PLL: 1500 MHz, divided to 125 MHz.
pub(crate) const SYSTEM_PLL: PllConfig =
    PllConfig { refdiv: 1, fbdiv: 125, post_div1: 6, post_div2: 2 };
/// Ticks of the deferred laws.
pub(crate) const LAW_TICKS: LawTicks = LawTicks::RP2040;
/// Size of the flash, bytes.
pub(crate) const FLASH_SIZE: usize = 2 * 1024 * 1024;
/// The flash driver.
pub(crate) type ConfigFlash = Flash<'static, FLASH, Blocking, FLASH_SIZE>;
/// The timer.
pub(crate) const TIMER: pac::timer::Timer = pac::TIMER;
/// Everything but the oscillators, in the order of the power-on state machine (PSM's WDSEL).
pub(crate) const RESET_ALL: u32 = 0x0001_fffc;
/// Vectors of a Cortex-M0+: the stack, 15 exceptions and 32 interrupts.
pub(crate) const VECTORS: usize = 48;
/// See [`Chip::has_latching_inputs`].
pub(crate) const HAS_LATCHING_INPUTS: bool = CHIP.has_latching_inputs();

/// The refused addresses: the 64 MiB below RAM. The region's base is a multiple of its size, 2 to
/// the power of `SIZE` + 1 bytes (ARMv6-M Architecture Reference Manual, B3.5.9). The registers of
/// the flash's interface end before it, at 0x1801_0000.
const GUARD_BASE: u32 = 0x1c00_0000;
const GUARD_SIZE: u32 = 25;
/// RBAR: the region's number, 0, is in the register too.
const RBAR_VALID: u32 = 1 << 4;
/// RASR: no access by anyone (AP = 0), no instructions.
const RASR_NO_EXECUTION: u32 = 1 << 28;
const RASR_ENABLE: u32 = 1;
/// CTRL: all other addresses are as without protection. The handlers of faults run without it.
const CTRL_DEFAULT_MAP: u32 = 1 << 2;
const CTRL_ENABLE: u32 = 1;

/// Makes every access below the stack a fault of the processor.
pub(crate) fn install_stack_guard() {
    // SAFETY: nothing else uses the memory protection, and the program has nothing in the region.
    unsafe {
        let mpu = &*MPU::PTR;
        mpu.rbar.write(GUARD_BASE | RBAR_VALID);
        mpu.rasr.write(RASR_NO_EXECUTION | GUARD_SIZE << 1 | RASR_ENABLE);
        mpu.ctrl.write(CTRL_DEFAULT_MAP | CTRL_ENABLE);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Returns the cause of a reset of the whole chip.
pub(crate) fn reset_cause() -> StartCause {
    let chip_reset = pac::VREG_AND_CHIP_RESET.chip_reset().read();
    match () {
        () if chip_reset.had_psm_restart() => StartCause::Requested,
        () if chip_reset.had_run() => StartCause::ResetPin,
        () => StartCause::PowerOn,
    }
}

/// Returns the stepping, which the version of the boot ROM tells (RP2040 data sheet, appendix B:
/// each stepping has a boot ROM of its own).
pub(crate) fn stepping() -> Option<[u8; 2]> {
    match rom_data::rom_version_number() {
        1 => Some(*b"B0"),
        2 => Some(*b"B1"),
        3 => Some(*b"B2"),
        _ => None,
    }
}

/// Returns the unique number of the flash chip (W25Q16JV, instruction 4Bh), which is the board's.
/// Call it before anything else runs: the flash is not readable meanwhile.
pub(crate) fn unique_id(flash: &mut ConfigFlash) -> Option<[u8; 8]> {
    let mut id = [0; 8];
    flash.blocking_unique_id(&mut id).ok().map(|()| id)
}

/// Connects a pad to its pin. An RP2040 has no isolation of pads.
pub(crate) fn connect_pad(_: &mut pac::pads::regs::GpioCtrl) {}
