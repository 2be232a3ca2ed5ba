//! What the board has to say, as bytes for whatever carries them.

use heapless::Vec;
use plumb_protocol::frame;
use plumb_protocol::message::FromBoard;

/// Messages that wait to become frames: more are made into frames at once.
const WAITING: usize = 8;

/// Messages waiting to be sent. They become frames when those are asked for, which takes a chip
/// some of its time. What does not fit is dropped whole and counted: a host that does not listen
/// must not hold the board up.
#[derive(Debug, Default)]
pub struct Outbox {
    waiting: Vec<FromBoard, WAITING>,
    bytes: Vec<u8, 1024>,
    dropped: u32,
}

impl Outbox {
    /// An empty one.
    pub const fn new() -> Self {
        Self { waiting: Vec::new(), bytes: Vec::new(), dropped: 0 }
    }

    /// Appends a message.
    pub fn send(&mut self, message: &FromBoard) {
        if let Err(message) = self.waiting.push(*message) {
            self.frame();
            let _ = self.waiting.push(message);
        }
    }

    /// Appends the frames of the messages that wait.
    fn frame(&mut self) {
        for message in &self.waiting {
            let framed = frame::encode(message)
                .ok()
                .and_then(|frame| self.bytes.extend_from_slice(&frame).ok());
            if framed.is_none() {
                self.dropped = self.dropped.saturating_add(1);
            }
        }
        self.waiting.clear();
    }

    /// Whether there is nothing to send.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.bytes.is_empty()
    }

    /// The bytes to send, oldest first.
    pub fn bytes(&mut self) -> &[u8] {
        self.frame();
        &self.bytes
    }

    /// Forgets what was sent.
    pub fn clear(&mut self) {
        self.waiting.clear();
        self.bytes.clear();
    }

    /// Messages that did not fit, since the start.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
