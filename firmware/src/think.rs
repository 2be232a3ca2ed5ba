//! Thread mode, below everything else: where laws that take longer than a tick think.
//!
//! The stepping leaves a question, and finds the answer when that is due.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use plumb_core::think::{Answer, Question, Thinker};
use static_cell::ConstStaticCell;

use crate::watch;

static QUESTION: Signal<CriticalSectionRawMutex, Question> = Signal::new();
static ANSWER: Signal<CriticalSectionRawMutex, Answer> = Signal::new();
/// Whether there is one to be looked for: that much is seen in some clocks, in every tick.
static ASKED: AtomicBool = AtomicBool::new(false);
static ANSWERED: AtomicBool = AtomicBool::new(false);

/// Leaves a question. For the stepping: never waits.
pub(crate) fn ask(question: Question) {
    QUESTION.signal(question);
    ASKED.store(true, Ordering::Release);
}

/// The answer to the last one, if it is there; once. For the stepping: never waits.
#[inline]
pub(crate) fn answer() -> Option<Answer> {
    if taken(&ANSWERED) { ANSWER.try_take() } else { None }
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
    static THINKER: ConstStaticCell<Thinker> = ConstStaticCell::new(Thinker::new());
    let thinker = THINKER.take();
    loop {
        watch::thread_is_alive();
        if !taken(&ASKED) {
            // Until the next interrupt: one that came since the look above ends the sleep before it
            // begins.
            cortex_m::asm::wfe();
        } else if let Some(question) = QUESTION.try_take() {
            ANSWER.signal(thinker.answer(&question));
            ANSWERED.store(true, Ordering::Release);
        }
    }
}
