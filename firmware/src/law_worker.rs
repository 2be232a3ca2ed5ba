//! Thread mode, below everything else: runs the deferred laws.
//!
//! The stepping interrupt leaves a request, and finds the response when it is due.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use plumb_core::law::KnownRig;
use plumb_core::law_worker::{LawRequest, LawResponse, LawWorker};
use static_cell::ConstStaticCell;

use crate::watchdog;

static REQUEST: Signal<CriticalSectionRawMutex, LawRequest> = Signal::new();
static RESPONSE: Signal<CriticalSectionRawMutex, LawResponse> = Signal::new();
/// Whether there is a request; checked in a few clocks.
static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Whether there is a response; checked in every tick.
static RESPONDED: AtomicBool = AtomicBool::new(false);

/// Whether [`known_rig`] waits.
static ASKED: AtomicBool = AtomicBool::new(false);
static KNOWN: Signal<CriticalSectionRawMutex, Option<KnownRig>> = Signal::new();

/// Returns what is known of the rig, once the worker has no request left.
pub(crate) async fn known_rig() -> Option<KnownRig> {
    ASKED.store(true, Ordering::Release);
    KNOWN.wait().await
}

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

/// Responds to requests for ever, and sleeps in between. The first law begins with the rig that is
/// `known`.
pub(crate) fn run(known: Option<KnownRig>) -> ! {
    static WORKER: ConstStaticCell<LawWorker> = ConstStaticCell::new(LawWorker::new());
    let law_worker = WORKER.take();
    law_worker.know(known);
    loop {
        watchdog::thread_is_alive();
        if taken(&REQUESTED) {
            if let Some(request) = REQUEST.try_take() {
                RESPONSE.signal(law_worker.respond(&request));
                RESPONDED.store(true, Ordering::Release);
            }
        } else if taken(&ASKED) {
            KNOWN.signal(law_worker.known_rig());
        } else {
            // Until the next interrupt. One that came since the checks above ends the sleep at
            // once.
            cortex_m::asm::wfe();
        }
    }
}
