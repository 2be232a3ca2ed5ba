//! Life of the thread that receives a stream.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use super::address::StreamAddress;
use super::endpoint::Endpoint;
use super::error::StreamError;
use super::receiver::{RawFrame, Receiver};
use crate::source::LiveClock;
use crate::source::capture::slot::Slot;

/// Thread that receives a stream. Dropping it closes the stream and waits for the thread, which
/// takes a tenth of a second at most.
#[derive(Debug)]
pub(super) struct Reception {
    slot: Arc<Slot<RawFrame>>,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
}

impl Reception {
    /// Listens at `address`. Frames are stamped with `clock`.
    ///
    /// # Errors
    /// Where the address cannot be used, or the operating system starts no thread.
    pub(super) fn start(address: &StreamAddress, clock: LiveClock) -> Result<Self, StreamError> {
        let slot = Arc::new(Slot::default());
        let receiver =
            Receiver { endpoint: Endpoint::listen(address)?, clock, slot: Arc::clone(&slot) };
        let thread = thread::Builder::new().name("stream".to_owned());
        let thread = thread.spawn(move || receiver.run()).map_err(StreamError::Io)?;
        Ok(Self { slot, thread: Some(thread) })
    }

    /// Returns the place of the newest frame.
    pub(super) fn slot(&self) -> &Slot<RawFrame> {
        &self.slot
    }
}

impl Drop for Reception {
    fn drop(&mut self) {
        self.slot.close();
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}
