//! The stack: its guard, and how much of it has never been used.
//!
//! The stack is the lowest part of RAM and grows downwards (memory.x). Nothing is mapped below it,
//! but the data sheet does not promise a fault there: "reserved" addresses next to the flash's
//! registers belong to the same bus port (RP2040 datasheet, section 2.2). So the processor's own
//! memory protection refuses them ([`install_guard`]).

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::MPU;

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

/// What fills the stack at the start.
const PATTERN: u32 = 0xa5a5_a5a5;
/// Bytes below the stack pointer that [`fill`] leaves alone.
const IN_USE: usize = 256;
/// Words that one [`scan`] reads, in about 5 µs. All of the stack takes 128 of them.
const SCAN_WORDS: usize = 64;

/// Bytes of the stack that have never been used.
#[used]
static FREE_STACK: AtomicU32 = AtomicU32::new(0);
/// Word that the next scan reads first.
static NEXT_WORD: AtomicU32 = AtomicU32::new(0);

unsafe extern "C" {
    /// Lowest word of the stack.
    static _stack_end: UnsafeCell<u32>;
}

/// Makes every access below the stack a fault of the processor.
pub(crate) fn install_guard() {
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

/// Fills the unused part of the stack with the pattern. Call it once, at the start.
#[inline(never)]
pub(crate) fn fill() {
    let in_use = cortex_m::register::msp::read() as usize - IN_USE;
    let words = (in_use - end() as usize) / size_of::<u32>();
    for i in 0..words {
        // SAFETY: the word is memory of the stack, below all that is in use.
        unsafe { end().add(i).write_volatile(PATTERN) };
    }
    FREE_STACK.store((words * size_of::<u32>()) as u32, Ordering::Relaxed);
}

/// Looks at the next words of the stack, from its lowest one upwards, for the first one that has
/// been used. Called by one task alone.
pub(crate) fn scan() {
    let first = NEXT_WORD.load(Ordering::Relaxed) as usize;
    let unused = free() as usize / size_of::<u32>();
    let last = unused.min(first + SCAN_WORDS);
    // SAFETY: the words are memory of the stack; a read of one that an interrupt writes at the same
    // time returns the old or the new value.
    let is_used = |&i: &usize| unsafe { end().add(i).read_volatile() } != PATTERN;
    let next = match (first..last).find(is_used) {
        Some(used) => {
            FREE_STACK.store((used * size_of::<u32>()) as u32, Ordering::Relaxed);
            0
        }
        None if last == unused => 0,
        None => last,
    };
    NEXT_WORD.store(next as u32, Ordering::Relaxed);
}

/// Returns the bytes of the stack that have never been used since the start; at most 3 s old.
pub(crate) fn free() -> u32 {
    FREE_STACK.load(Ordering::Relaxed)
}

/// Returns the lowest word of the stack.
fn end() -> *mut u32 {
    // SAFETY: the linker defines the symbol (memory.x); only its address is used.
    unsafe { _stack_end.get() }
}
