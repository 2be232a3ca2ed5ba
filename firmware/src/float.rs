//! Arithmetic of `f32` by plumb-core's [`soft_float`], which is faster than the compiler's own.
//!
//! The compiler calls these functions by the names of the ARM run-time ABI, as it does for integers
//! (`divide.rs`); they replace its own. Both follow IEEE 754, so every bit of a result is the same.

use plumb_core::soft_float;

use crate::divide::divide;

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
