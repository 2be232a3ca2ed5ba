//! The RP2350A of a Raspberry Pi Pico 2: two Cortex-M33, 150 MHz.

use core::ffi::CStr;

use embassy_rp::clocks::PllConfig;
use embassy_rp::flash::{Blocking, Flash};
use embassy_rp::peripherals::FLASH;
use embassy_rp::{otp, pac, rom_data};
use plumb_core::law::LawTicks;
use plumb_protocol::boards::Chip;
use plumb_protocol::message::StartCause;
use plumb_protocol::provenance::BoardKind;

pub(crate) use embassy_rp::interrupt::{TIMER0_IRQ_0 as TIME_DRIVER, TIMER0_IRQ_1 as STEPPING};

/// The chip.
pub(crate) const CHIP: Chip = Chip::Rp2350;
/// Kind of board that the firmware calls itself.
pub(crate) const BOARD: BoardKind = BoardKind::Pico2;
/// The board's name for picotool.
pub(crate) const PICO_BOARD: &CStr = c"pico2";
/// Product id of a Pico 2's serial port on USB, which Raspberry Pi lets anyone use
/// (raspberrypi/usb-pid).
pub(crate) const USB_PRODUCT: u16 = 0x0009;
/// The system's PLL: 1500 MHz, divided to 150 MHz.
pub(crate) const SYSTEM_PLL: PllConfig =
    PllConfig { refdiv: 1, fbdiv: 125, post_div1: 5, post_div2: 2 };
/// Ticks of the deferred laws.
pub(crate) const LAW_TICKS: LawTicks = LawTicks::RP2040;
/// Size of the flash, bytes.
pub(crate) const FLASH_SIZE: usize = 4 * 1024 * 1024;
/// The flash driver.
pub(crate) type ConfigFlash = Flash<'static, FLASH, Blocking, FLASH_SIZE>;
/// The timer.
pub(crate) const TIMER: pac::timer::Timer = pac::TIMER0;
/// Everything but the oscillators, in the order of the power-on state machine (PSM's WDSEL), as the
/// SDK's `watchdog_enable` has it. embassy-rp 0.10 writes the RP2040's number, which leaves out the
/// processors.
pub(crate) const RESET_ALL: u32 = 0x01ff_fff3;
/// Vectors of the chip: the stack, 15 exceptions and 52 interrupts.
pub(crate) const VECTORS: usize = 68;
/// See [`Chip::has_latching_inputs`].
pub(crate) const HAS_LATCHING_INPUTS: bool = CHIP.has_latching_inputs();

/// Makes a stack pointer below the stack a fault of the processor. Nothing is left to do: the
/// program's first instructions have set MSPLIM (cortex-m-rt's `set-msplim`).
pub(crate) fn install_stack_guard() {}

/// Returns the cause of a reset of the whole chip: CHIP_RESET has the source of the last one
/// (RP2350 datasheet, section 7.3.4).
pub(crate) fn reset_cause() -> StartCause {
    let last = pac::POWMAN.chip_reset().read();
    match () {
        () if last.had_bor() => StartCause::BrownOut,
        () if last.had_run_low() => StartCause::ResetPin,
        () if last.had_rescue() || last.had_dp_reset_req() => StartCause::Requested,
        () => StartCause::PowerOn,
    }
}

/// Returns the stepping, which the version of the boot ROM tells: the SDK's `rp2350_rom_version`.
pub(crate) fn stepping() -> Option<[u8; 2]> {
    match rom_data::rom_version_number() {
        2 => Some(*b"A2"),
        3 => Some(*b"A3"),
        4 => Some(*b"A4"),
        _ => None,
    }
}

/// Returns the unique number of the chip, as its bootloader has it in the serial number of USB.
pub(crate) fn unique_id(_: &mut ConfigFlash) -> Option<[u8; 8]> {
    otp::get_chipid().ok().map(u64::to_be_bytes)
}

/// Connects a pad to its pin: a reset isolates it (RP2350 datasheet, section 9.7).
pub(crate) fn connect_pad(pad: &mut pac::pads::regs::GpioCtrl) {
    pad.set_iso(false);
}
