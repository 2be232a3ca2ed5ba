//! What the chip has counted, for the diagnosis of a board: late ticks, resets of USB, dropped
//! frames, and where the processor was at its last fault. What is left of the stack is in
//! [`crate::stack`].

use core::sync::atomic::{AtomicU32, Ordering};

use plumb_protocol::diagnostics::{ChipCounts, ProcessorFault};

use crate::stack;

#[used]
static LATE_TICKS: AtomicU32 = AtomicU32::new(0);
#[used]
static LATE_AT_REST: AtomicU32 = AtomicU32::new(0);
#[used]
static USB_RESETS: AtomicU32 = AtomicU32::new(0);
#[used]
static DROPPED_FRAMES: AtomicU32 = AtomicU32::new(0);
#[used]
static FAULT_PC: AtomicU32 = AtomicU32::new(0);
#[used]
static FAULT_LR: AtomicU32 = AtomicU32::new(0);

/// Counts a tick that was planned too late. Called by the stepping interrupt alone.
pub(crate) fn count_late_tick(moving: bool) {
    let counter = if moving { &LATE_TICKS } else { &LATE_AT_REST };
    counter.store(counter.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
}

/// Counts frames that the outbox has no room for. Called by the stepping interrupt alone.
pub(crate) fn count_dropped_frames(frames: u32) {
    DROPPED_FRAMES
        .store(DROPPED_FRAMES.load(Ordering::Relaxed).saturating_add(frames), Ordering::Relaxed);
}

/// Returns how often the supervisor of USB has reset its controller.
fn usb_resets() -> u16 {
    USB_RESETS.load(Ordering::Relaxed) as u16
}

/// Counts a reset of the USB controller. Called by its supervisor alone.
pub(crate) fn count_usb_reset() {
    USB_RESETS.store(usb_resets().saturating_add(1).into(), Ordering::Relaxed);
}

/// Keeps the registers of the fault that ended the last run.
pub(crate) fn set_last_fault(registers: ProcessorFault) {
    FAULT_PC.store(registers.pc, Ordering::Relaxed);
    FAULT_LR.store(registers.lr, Ordering::Relaxed);
}

/// Returns the registers at the fault that ended the last run; `None` where no fault ended it.
fn last_fault() -> Option<ProcessorFault> {
    let [pc, lr] = [&FAULT_PC, &FAULT_LR].map(|register| register.load(Ordering::Relaxed));
    (pc != 0 || lr != 0).then_some(ProcessorFault { pc, lr })
}

/// Returns everything that was counted since the start; `dropped` frames were dropped by the
/// board's own outbox.
#[cold]
pub(crate) fn counts(dropped: u32) -> ChipCounts {
    ChipCounts {
        late_ticks: LATE_TICKS.load(Ordering::Relaxed),
        late_at_rest: LATE_AT_REST.load(Ordering::Relaxed),
        free_stack: Some(stack::free()),
        usb_resets: usb_resets(),
        fault: last_fault(),
        dropped_frames: DROPPED_FRAMES.load(Ordering::Relaxed).saturating_add(dropped),
    }
}
