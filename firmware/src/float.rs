//! Numbers of 32 bits by plumb-core's [`soft_float`], which takes less time than the compiler's
//! own.
//!
//! As with whole numbers ([`crate::divide`]): the compiler calls these functions by the names of
//! the ARM run-time ABI, and what is here goes before its own. They keep to IEEE 754 as those do,
//! so that no bit of a result depends on which is taken.

use plumb_core::soft_float;

use crate::divide::divide;

/// `a` + `b`.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fadd(a: u32, b: u32) -> u32 {
    soft_float::add(a, b)
}

/// `a` - `b`.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fsub(a: u32, b: u32) -> u32 {
    soft_float::add(a, b ^ 1 << 31)
}

/// `b` - `a`.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_frsub(a: u32, b: u32) -> u32 {
    soft_float::add(b, a ^ 1 << 31)
}

/// `a` `b`.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fmul(a: u32, b: u32) -> u32 {
    soft_float::multiply(a, b)
}

/// `a` / `b`.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fdiv(a: u32, b: u32) -> u32 {
    soft_float::divide(a, b, divide)
}

/// 1 where `a` == `b`, else 0.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpeq(a: u32, b: u32) -> i32 {
    i32::from(soft_float::equal(a, b))
}

/// 1 where `a` < `b`, else 0.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmplt(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less(a, b))
}

/// 1 where `a` <= `b`, else 0.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmple(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less_or_equal(a, b))
}

/// 1 where `a` > `b`, else 0.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpgt(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less(b, a))
}

/// 1 where `a` >= `b`, else 0.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpge(a: u32, b: u32) -> i32 {
    i32::from(soft_float::less_or_equal(b, a))
}

/// 1 where one of them is NaN, else 0.
// SAFETY: the run-time ABI's name for just this.
#[unsafe(no_mangle)]
extern "aapcs" fn __aeabi_fcmpun(a: u32, b: u32) -> i32 {
    i32::from(soft_float::unordered(a, b))
}
