//! Interruptions of the program, which end the threads of the DDS library for good.
//!
//! The operating system interrupts all waits when the program was stopped and goes on (Ctrl-Z and
//! `fg`, a debugger), and when the computer was suspended. The library takes that as a failure.

use std::io::ErrorKind;
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use rustdds::mio1::{Events, Poll};

/// Interruptions since the first call of [`count`].
static COUNT: AtomicU64 = AtomicU64::new(0);

/// Start of the thread that counts.
static START: Once = Once::new();

/// Returns the number of interruptions since the first call.
pub(crate) fn count() -> u64 {
    START.call_once(|| {
        // Without the thread, the node notices only what `Member::is_alive` asks the library.
        let _none = thread::Builder::new().name("interruptions".to_owned()).spawn(watch);
    });
    COUNT.load(Ordering::Relaxed)
}

/// Waits as the library does, for nothing, and counts the interruptions. The library's threads may
/// be at work at that moment; this one never is.
fn watch() {
    let Ok(mut poll) = Poll::new() else { return };
    let mut events = Events::with_capacity(1);
    while poll.poll(&mut events, None).is_err_and(|it| it.kind() == ErrorKind::Interrupted) {
        COUNT.fetch_add(1, Ordering::Relaxed);
    }
}
