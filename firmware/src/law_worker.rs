//! Thread mode, below everything else: runs the deferred laws.
//!
//! The stepping interrupt leaves a request, and finds the response when it is due.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use plumb_core::law_worker::{LawRequest, LawResponse, LawWorker};
use static_cell::ConstStaticCell;

use crate::watchdog;

static REQUEST: Signal<CriticalSectionRawMutex, LawRequest> = Signal::new();
static RESPONSE: Signal<CriticalSectionRawMutex, LawResponse> = Signal::new();
/// Whether there is a request; checked in a few clocks.
static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Whether there is a response; checked in every tick.
static RESPONDED: AtomicBool = AtomicBool::new(false);

/// Leaves a request. Called by the stepping interrupt; never waits.
pub(crate) fn request(request: LawRequest) {
    REQUEST.signal(request);
    REQUESTED.store(true, Ordering::Release);
}

/// Returns the response to the last request, once. Called by the stepping interrupt; never waits.
#[inline]
pub(crate) fn response() -> Option<LawResponse> {
    if taken(&RESPONDED) { RESPONSE.try_take() } else { None }
}

/// Takes `flag`, and returns whether it was set. Where it is set again in between, the new request
/// or response is there too.
#[inline]
fn taken(flag: &AtomicBool) -> bool {
    let set = flag.load(Ordering::Acquire);
    if set {
        flag.store(false, Ordering::Release);
    }
    set
}

/// Responds to requests for ever, and sleeps in between.
pub(crate) fn run() -> ! {
    static WORKER: ConstStaticCell<LawWorker> = ConstStaticCell::new(LawWorker::new());
    let law_worker = WORKER.take();
    loop {
        watchdog::thread_is_alive();
        if !taken(&REQUESTED) {
            // Until the next interrupt. One that came since the check above ends the sleep at once.
            cortex_m::asm::wfe();
        } else if let Some(request) = REQUEST.try_take() {
            RESPONSE.signal(law_worker.respond(&request));
            RESPONDED.store(true, Ordering::Release);
        }
    }
}
