//! Memory that a page's subject shares with the server thread.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::signal::Signal;

/// News of a page's subject. Each change is counted and wakes the server thread.
pub(crate) struct Shared<News> {
    news: Mutex<News>,
    /// Number of changes. It grows under the lock of `news`.
    version: AtomicU64,
    signal: Signal,
}

impl<News: Default> Shared<News> {
    /// Creates memory without news.
    pub(crate) fn new(signal: Signal) -> Self {
        Self { news: Mutex::default(), version: AtomicU64::new(0), signal }
    }

    /// Returns the news, to read or to change.
    pub(crate) fn lock(&self) -> MutexGuard<'_, News> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a change of `news`, releases them and wakes the server thread.
    pub(crate) fn publish(&self, news: MutexGuard<'_, News>) {
        self.version.fetch_add(1, Ordering::Relaxed);
        drop(news);
        self.signal.wake();
    }

    /// Returns the number of changes so far.
    pub(crate) fn version(&self) -> u64 {
        self.version.load(Ordering::Relaxed)
    }

    /// Returns the signals to the server thread.
    pub(crate) fn signal(&self) -> &Signal {
        &self.signal
    }
}
