//! What the board has to say, as bytes for whatever carries them.

use heapless::Vec;
use plumb_protocol::frame;
use plumb_protocol::message::FromBoard;

/// Frames waiting to be sent. What does not fit is dropped whole and counted: a host that does not listen must not
/// hold the board up.
#[derive(Debug, Default)]
pub struct Outbox {
    bytes: Vec<u8, 1024>,
    dropped: u32,
}

impl Outbox {
    /// An empty one.
    pub const fn new() -> Self {
        Self { bytes: Vec::new(), dropped: 0 }
    }

    /// Appends the message's frame.
    pub fn send(&mut self, message: &FromBoard) {
        let sent = frame::encode(message).ok().and_then(|frame| self.bytes.extend_from_slice(&frame).ok());
        if sent.is_none() {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    /// The bytes to send, oldest first.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Forgets what was sent.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }

    /// Messages that did not fit, since the start.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
