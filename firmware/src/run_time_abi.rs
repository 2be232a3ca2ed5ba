//! Arithmetic that the compiler calls by the names of the ARM run-time ABI: division of integers by
//! the chip's divider, and `f32` by plumb-core's [`soft_float`]. The functions replace the
//! compiler's own.
//!
//! **Division** takes the hardware divider 8 clocks, where the compiler's own routine takes
//! hundreds. All interrupts share the divider, so interrupts are masked from writing the operands
//! to reading the results: about 15 clocks.
//!
//! embassy-rp 0.10 has a divider too (feature `intrinsics`), but that feature also replaces the
//! arithmetic of `f32` by the boot ROM's. The ROM's flushes subnormals to zero, so that chip and
//! emulated board would no longer agree to the bit, and its symbols clash with those of this file:
//! it does not link. Its divider alone gains nothing. With its code in place of this file's, an
//! update of the law `adaptive` took 43 158 clocks instead of 43 587, one of `taut` 1 319 071
//! instead of 1 315 067, and the median tick the same 948 (`make bench-chip`).
//!
//! **`f32`** follows IEEE 754 both here and in the compiler's own routines, so every bit of a
//! result is the same; [`soft_float`] is faster.

use core::arch::asm;

use embassy_rp::pac;
use plumb_core::soft_float;

/// Returns `dividend / divisor` and the remainder. A divisor of 0 gives all ones and the dividend,
/// as the hardware does; Rust checks for 0 before it divides.
#[inline(always)]
fn divide(dividend: u32, divisor: u32) -> (u32, u32) {
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

/// Returns `a` + `b`.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fadd(a: u32, b: u32) -> u32 {
    soft_float::add(a, b)
}

/// Returns `a` - `b`.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fsub(a: u32, b: u32) -> u32 {
    soft_float::add(a, b ^ 1 << 31)
}

/// Returns `b` - `a`.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_frsub(a: u32, b: u32) -> u32 {
    soft_float::add(b, a ^ 1 << 31)
}

/// Returns `a` times `b`.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fmul(a: u32, b: u32) -> u32 {
    soft_float::multiply(a, b)
}

/// Returns `a` / `b`.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fdiv(a: u32, b: u32) -> u32 {
    soft_float::divide(a, b, divide)
}

/// Returns 1 where `a` == `b`, else 0.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpeq(a: u32, b: u32) -> i32 {
    i32::from(soft_float::equal(a, b))
}

/// Returns 1 where `a` < `b`, else 0.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmplt(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less(a, b))
}

/// Returns 1 where `a` <= `b`, else 0.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmple(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less_or_equal(a, b))
}

/// Returns 1 where `a` > `b`, else 0.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpgt(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less(b, a))
}

/// Returns 1 where `a` >= `b`, else 0.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpge(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less_or_equal(b, a))
}

/// Returns 1 where one of them is NaN, else 0.
// SAFETY: the run-time ABI gives this function this name and signature.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpun(a: u32, b: u32) -> i32 {
    i32::from(soft_float::unordered(a, b))
}
