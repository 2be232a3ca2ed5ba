//! Counters for the diagnosis of a board: late ticks, resets of USB, and where the processor was
//! at its last fault. What is left of the stack is in [`crate::stack`].

use core::sync::atomic::{AtomicU32, Ordering};

#[used]
static LATE_TICKS: AtomicU32 = AtomicU32::new(0);
#[used]
static LATE_AT_REST: AtomicU32 = AtomicU32::new(0);
#[used]
static USB_RESETS: AtomicU32 = AtomicU32::new(0);
#[used]
static FAULT_PC: AtomicU32 = AtomicU32::new(0);
#[used]
static FAULT_LR: AtomicU32 = AtomicU32::new(0);

/// Registers of the processor at a fault.
#[derive(Clone, Copy)]
pub(crate) struct FaultRegisters {
    /// Address of the instruction. 0 where the stack had overflowed: then there was no memory to
    /// save the registers in.
    pub(crate) pc: u32,
    /// The link register: an address in the function that had called last.
    pub(crate) lr: u32,
}

/// Counts a tick that was planned too late. Called by the stepping interrupt alone.
pub(crate) fn count_late_tick(moving: bool) {
    let counter = if moving { &LATE_TICKS } else { &LATE_AT_REST };
    counter.store(counter.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
}

/// Returns how many ticks were planned too late while motors turned.
pub(crate) fn late_ticks() -> u32 {
    LATE_TICKS.load(Ordering::Relaxed)
}

/// Returns how many ticks were planned too late at rest: at the start, at a new configuration, and
/// after the flash was written.
pub(crate) fn late_at_rest() -> u32 {
    LATE_AT_REST.load(Ordering::Relaxed)
}

/// Returns how often the supervisor of USB has reset its controller.
pub(crate) fn usb_resets() -> u16 {
    USB_RESETS.load(Ordering::Relaxed) as u16
}

/// Counts a reset of the USB controller. Called by its supervisor alone.
pub(crate) fn count_usb_reset() {
    USB_RESETS.store(usb_resets().saturating_add(1).into(), Ordering::Relaxed);
}

/// Keeps the registers of the fault that ended the last run.
pub(crate) fn set_last_fault(registers: FaultRegisters) {
    FAULT_PC.store(registers.pc, Ordering::Relaxed);
    FAULT_LR.store(registers.lr, Ordering::Relaxed);
}

/// Returns the registers at the fault that ended the last run; zeros where no fault ended it.
pub(crate) fn last_fault() -> FaultRegisters {
    let [pc, lr] = [&FAULT_PC, &FAULT_LR].map(|register| register.load(Ordering::Relaxed));
    FaultRegisters { pc, lr }
}
