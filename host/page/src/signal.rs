//! Signals between a page's source of news and its server thread.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use mio::Waker;

/// Signals of one page.
pub(crate) struct Signal {
    waker: Waker,
    /// Number of open pages.
    watchers: AtomicUsize,
    closing: AtomicBool,
}

impl Signal {
    pub(crate) fn new(waker: Waker) -> Self {
        let (watchers, closing) = (AtomicUsize::new(0), AtomicBool::new(false));
        Self { waker, watchers, closing }
    }

    /// Wakes the server thread.
    pub(crate) fn wake(&self) {
        // A thread that cannot be woken looks once a second.
        let _ = self.waker.wake();
    }

    /// Sets the number of open pages.
    pub(crate) fn set_watchers(&self, count: usize) {
        self.watchers.store(count, Ordering::Relaxed);
    }

    /// Returns the number of open pages.
    pub(crate) fn watchers(&self) -> usize {
        self.watchers.load(Ordering::Relaxed)
    }

    /// Returns whether a page is open. Without one no frame is kept.
    pub(crate) fn is_watched(&self) -> bool {
        self.watchers() > 0
    }

    /// Asks the server thread to end.
    pub(crate) fn close(&self) {
        self.closing.store(true, Ordering::Relaxed);
        self.wake();
    }

    pub(crate) fn is_closing(&self) -> bool {
        self.closing.load(Ordering::Relaxed)
    }
}
