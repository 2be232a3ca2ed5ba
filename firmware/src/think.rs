//! Thread mode, below everything else: where laws that take longer than a tick think.
//!
//! The stepping leaves a question, and finds the answer when that is due.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use plumb_core::think::{Answer, Question, Thinker};
use static_cell::ConstStaticCell;

use crate::watch;

static QUESTION: Signal<CriticalSectionRawMutex, Question> = Signal::new();
static ANSWER: Signal<CriticalSectionRawMutex, Answer> = Signal::new();

/// Leaves a question. For the stepping: never waits.
pub(crate) fn ask(question: Question) {
    QUESTION.signal(question);
}

/// The answer to the last one, if it is there; once. For the stepping: never waits.
pub(crate) fn answer() -> Option<Answer> {
    ANSWER.try_take()
}

/// Answers questions for ever, and sleeps in between.
pub(crate) fn run() -> ! {
    static THINKER: ConstStaticCell<Thinker> = ConstStaticCell::new(Thinker::new());
    let thinker = THINKER.take();
    loop {
        watch::thread_is_alive();
        match QUESTION.try_take() {
            Some(question) => ANSWER.signal(thinker.answer(&question)),
            // Until the next interrupt: one that came since the look above ends the sleep before it begins.
            None => cortex_m::asm::wfe(),
        }
    }
}
