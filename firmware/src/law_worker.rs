//! Thread mode, below everything else: where laws that take longer than a tick think.
//!
//! The stepping leaves a question, and finds the answer when that is due.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use plumb_core::law_worker::{LawRequest, LawResponse, LawWorker};
use static_cell::ConstStaticCell;

use crate::watch;

static REQUEST: Signal<CriticalSectionRawMutex, LawRequest> = Signal::new();
static RESPONSE: Signal<CriticalSectionRawMutex, LawResponse> = Signal::new();
/// Whether there is one to be looked for: that much is seen in some clocks, in every tick.
static REQUESTED: AtomicBool = AtomicBool::new(false);
static RESPONDED: AtomicBool = AtomicBool::new(false);

/// Leaves a question. For the stepping: never waits.
pub(crate) fn request(request: LawRequest) {
    REQUEST.signal(request);
    REQUESTED.store(true, Ordering::Release);
}

/// The answer to the last one, if it is there; once. For the stepping: never waits.
#[inline]
pub(crate) fn response() -> Option<LawResponse> {
    if taken(&RESPONDED) { RESPONSE.try_take() } else { None }
}

/// Whether `flag` was set; it no longer is. Where it is set anew in between, so is what it tells
/// of.
#[inline]
fn taken(flag: &AtomicBool) -> bool {
    let set = flag.load(Ordering::Acquire);
    if set {
        flag.store(false, Ordering::Release);
    }
    set
}

/// Answers questions for ever, and sleeps in between.
pub(crate) fn run() -> ! {
    static WORKER: ConstStaticCell<LawWorker> = ConstStaticCell::new(LawWorker::new());
    let law_worker = WORKER.take();
    loop {
        watch::thread_is_alive();
        if !taken(&REQUESTED) {
            // Until the next interrupt: one that came since the look above ends the sleep before it
            // begins.
            cortex_m::asm::wfe();
        } else if let Some(request) = REQUEST.try_take() {
            RESPONSE.signal(law_worker.respond(&request));
            RESPONDED.store(true, Ordering::Release);
        }
    }
}
