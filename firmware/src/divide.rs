//! Integer division by the chip's hardware divider: 8 clocks, where the compiler's own routine
//! takes hundreds.
//!
//! The compiler calls these functions, by the names of the ARM run-time ABI, for every division of
//! integers; they replace its own. All interrupts share the divider, so interrupts are masked from
//! writing the operands to reading the results: about 15 clocks.
//!
//! embassy-rp 0.10 has a divider too (feature `intrinsics`), but that feature also replaces the
//! arithmetic of `f32` by the boot ROM's. The ROM's flushes subnormals to zero, so that chip and
//! emulated board would no longer agree to the bit, and its symbols clash with those of
//! [`float`](crate::float): it does not link. Its divider alone gains nothing. With its code in
//! place of this file, an update of the law `adaptive` took 43 158 clocks instead of 43 587, one of
//! `taut` 1 319 071 instead of 1 315 067, and the median tick the same 948 (`make bench-chip`).

use core::arch::asm;

use embassy_rp::pac;

/// Returns `dividend / divisor` and the remainder. A divisor of 0 gives all ones and the dividend,
/// as the hardware does; Rust checks for 0 before it divides.
#[inline(always)]
pub(crate) fn divide(dividend: u32, divisor: u32) -> (u32, u32) {
    let mask: u32;
    // SAFETY: reads the interrupt mask and masks interrupts; the mask is restored below.
    unsafe { asm!("mrs {}, PRIMASK", "cpsid i", out(reg) mask, options(nostack, preserves_flags)) };
    let divider = pac::SIO.div();
    divider.udividend().write_value(dividend);
    divider.udivisor().write_value(divisor);
    // SAFETY: four branches to the next instruction wait for the divider's 8 clocks.
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
    // The quotient last: reading it clears the divider's state (CSR.DIRTY).
    let quotient = divider.quotient().read();
    // SAFETY: restores the interrupt mask.
    unsafe { asm!("msr PRIMASK, {}", in(reg) mask, options(nostack, preserves_flags)) };
    (quotient, remainder)
}

/// Returns the unsigned quotient.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_uidiv(dividend: u32, divisor: u32) -> u32 {
    divide(dividend, divisor).0
}

/// Returns the unsigned quotient in r0 and the remainder in r1, as one number of 64 bits.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_uidivmod(dividend: u32, divisor: u32) -> u64 {
    let (quotient, remainder) = divide(dividend, divisor);
    u64::from(quotient) | u64::from(remainder) << 32
}

/// Returns the signed quotient, rounded towards zero.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_idiv(dividend: i32, divisor: i32) -> i32 {
    let quotient = divide(dividend.unsigned_abs(), divisor.unsigned_abs()).0 as i32;
    if (dividend < 0) == (divisor < 0) { quotient } else { quotient.wrapping_neg() }
}

/// Returns the signed quotient in r0 and the remainder, with the dividend's sign, in r1.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_idivmod(dividend: i32, divisor: i32) -> u64 {
    let (quotient, remainder) = divide(dividend.unsigned_abs(), divisor.unsigned_abs());
    let quotient = if (dividend < 0) == (divisor < 0) { quotient } else { quotient.wrapping_neg() };
    let remainder = if dividend < 0 { remainder.wrapping_neg() } else { remainder };
    u64::from(quotient) | u64::from(remainder) << 32
}
