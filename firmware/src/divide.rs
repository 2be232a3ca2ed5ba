//! Division by the chip's divider, which takes 8 clocks where the compiler's own takes hundreds.
//!
//! The compiler calls these functions, by the names of the ARM run-time ABI, wherever whole numbers
//! are divided; what is here goes before its own. The divider is shared with every interrupt, so
//! nothing may come between giving it its operands and taking its results: that is some 15 clocks
//! with interrupts off.

use core::arch::asm;

use embassy_rp::pac;

/// `dividend / divisor` and the remainder; for a divisor of 0 what the hardware makes of it (all
/// ones, and the dividend): Rust checks for 0 before it divides.
#[inline(always)]
pub(crate) fn divide(dividend: u32, divisor: u32) -> (u32, u32) {
    let mask: u32;
    // SAFETY: reads the interrupt mask and masks interrupts; put back below.
    unsafe { asm!("mrs {}, PRIMASK", "cpsid i", out(reg) mask, options(nostack, preserves_flags)) };
    let divider = pac::SIO.div();
    divider.udividend().write_value(dividend);
    divider.udivisor().write_value(divisor);
    // SAFETY: waits the divider's 8 clocks and does nothing else.
    unsafe {
        asm!(
            "b 1f",
            "1: b 1f",
            "1: b 1f",
            "1: b 1f",
            "1:",
            options(nomem, nostack, preserves_flags)
        )
    };
    let remainder = divider.remainder().read();
    // Last: the hardware counts the results as taken when the quotient is read.
    let quotient = divider.quotient().read();
    // SAFETY: the mask as it was.
    unsafe { asm!("msr PRIMASK, {}", in(reg) mask, options(nostack, preserves_flags)) };
    (quotient, remainder)
}

/// Unsigned quotient.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_uidiv(dividend: u32, divisor: u32) -> u32 {
    divide(dividend, divisor).0
}

/// Unsigned quotient in r0, remainder in r1: as one number of 64 bits.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_uidivmod(dividend: u32, divisor: u32) -> u64 {
    let (quotient, remainder) = divide(dividend, divisor);
    u64::from(quotient) | u64::from(remainder) << 32
}

/// Signed quotient, towards zero.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_idiv(dividend: i32, divisor: i32) -> i32 {
    let quotient = divide(dividend.unsigned_abs(), divisor.unsigned_abs()).0 as i32;
    if (dividend < 0) == (divisor < 0) { quotient } else { quotient.wrapping_neg() }
}

/// Signed quotient in r0, remainder with the dividend's sign in r1.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_idivmod(dividend: i32, divisor: i32) -> u64 {
    let (quotient, remainder) = divide(dividend.unsigned_abs(), divisor.unsigned_abs());
    let quotient = if (dividend < 0) == (divisor < 0) { quotient } else { quotient.wrapping_neg() };
    let remainder = if dividend < 0 { remainder.wrapping_neg() } else { remainder };
    u64::from(quotient) | u64::from(remainder) << 32
}
