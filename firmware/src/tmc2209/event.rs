//! The last event of motor drivers on a UART, from their task to the stepping interrupt.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use plumb_core::tmc2209::Event;

/// Number of the wiring in force. What the task does for another one has no effect.
static WIRING: AtomicU32 = AtomicU32::new(0);
/// The event.
static EVENT: Mutex<Cell<Option<Event>>> = Mutex::new(Cell::new(None));

/// Returns the number of the wiring in force.
#[inline(always)]
pub(crate) fn wiring_in_force() -> u32 {
    WIRING.load(Ordering::Relaxed)
}

/// Ends the wiring in force, and drops its event. Returns the number of the next one.
#[inline(always)]
pub(crate) fn begin_wiring() -> u32 {
    // Only the stepping interrupt, which calls this, changes the number.
    let number = WIRING.load(Ordering::Relaxed).wrapping_add(1);
    WIRING.store(number, Ordering::Relaxed);
    critical_section::with(|cs| EVENT.borrow(cs).set(None));
    number
}

/// Reports an event of drivers of a wiring with this number to the coming tick, unless another
/// wiring is in force. The interrupt waits meanwhile: this code is in RAM.
#[inline(never)]
pub(crate) fn report(number: u32, event: Event) {
    critical_section::with(|cs| {
        if wiring_in_force() == number {
            EVENT.borrow(cs).set(Some(event));
        }
    });
}

/// Takes the event.
#[inline(always)]
pub(crate) fn take() -> Option<Event> {
    critical_section::with(|cs| EVENT.borrow(cs).take())
}
