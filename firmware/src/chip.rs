//! What differs between the chips: one module for each, with the same names in it.

#[cfg(all(feature = "rp2040", feature = "rp2350"))]
compile_error!("choose one chip: the feature `rp2350` needs --no-default-features");

use embassy_rp::clocks::{
    ClockConfig, CoreVoltage, PeriClkSrc, PllConfig, RefClkConfig, RefClkSrc, SysClkConfig,
    SysClkSrc, UsbClkConfig, UsbClkSrc, XoscConfig,
};
use plumb_core::timing::CLOCK_HZ;

#[cfg(not(feature = "rp2350"))]
mod rp2040;
#[cfg(feature = "rp2350")]
mod rp2350;

#[cfg(not(feature = "rp2350"))]
pub(crate) use rp2040::*;
#[cfg(feature = "rp2350")]
pub(crate) use rp2350::*;

/// Frequency of the crystal, Hz: on every board with one of the chips.
const CRYSTAL_HZ: u32 = 12_000_000;

const _: () = {
    let PllConfig { refdiv, fbdiv, post_div1, post_div2 } = SYSTEM_PLL;
    let oscillator = CRYSTAL_HZ / refdiv as u32 * fbdiv as u32;
    assert!(oscillator / (post_div1 as u32 * post_div2 as u32) == CLOCK_HZ, "the planned clock");
};

/// Returns the chip's clocks: those of processor, state machines, DMA and UARTs from the system's
/// PLL, that of USB at 48 MHz, and the timer's from the crystal.
pub(crate) fn clocks() -> ClockConfig {
    let mut clocks = ClockConfig::crystal(CRYSTAL_HZ);
    clocks.xosc = Some(XoscConfig {
        hz: CRYSTAL_HZ,
        sys_pll: Some(SYSTEM_PLL),
        usb_pll: Some(PllConfig { refdiv: 1, fbdiv: 120, post_div1: 6, post_div2: 5 }),
        delay_multiplier: 128,
    });
    clocks.ref_clk = RefClkConfig { src: RefClkSrc::Xosc, div: 1 };
    clocks.sys_clk = SysClkConfig { src: SysClkSrc::PllSys, div_int: 1, div_frac: 0 };
    clocks.peri_clk_src = Some(PeriClkSrc::Sys);
    clocks.usb_clk = Some(UsbClkConfig { src: UsbClkSrc::PllUsb, div: 1, phase: 0 });
    clocks.core_voltage = CoreVoltage::V1_10;
    clocks
}

/// Returns the timer, µs; it wraps after 71 minutes.
#[inline(always)]
pub(crate) fn timer() -> u32 {
    TIMER.timerawl().read()
}
