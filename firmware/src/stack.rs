//! The stack: its guard, and how much of it has never been used.
//!
//! The stack is the lowest part of RAM and grows downwards (memory-rp2040.x, memory-rp2350.x).
//! Nothing is mapped below it, but the data sheet does not promise a fault there: "reserved"
//! addresses next to the flash's registers belong to the same bus port (RP2040 datasheet, section
//! 2.2). So the processor itself refuses them: by its memory protection on an RP2040, by the limit
//! of its stack pointer on an RP2350 ([`crate::chip::install_stack_guard`]).

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

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
    // SAFETY: the linker defines the symbol (memory-rp2040.x); only its address is used.
    unsafe { _stack_end.get() }
}
