//! The board's messages to the host, as bytes for any link.

use heapless::Vec;
use plumb_protocol::frame;
use plumb_protocol::message::{Answer, FromBoard, Refusal};
use plumb_protocol::units::Micros;

/// Messages that can wait to become frames. When one more comes, all become frames at once.
const WAITING: usize = 8;

/// Queue of messages to the host. They become frames when the bytes are read, since encoding takes
/// the chip some time. A message that does not fit is dropped whole and counted: a host that does
/// not listen must not hold the board up.
#[derive(Debug, Default)]
pub struct Outbox {
    waiting: Vec<FromBoard, WAITING>,
    bytes: Vec<u8, 1024>,
    dropped: u32,
}

impl Outbox {
    /// Creates an empty queue.
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

    /// Appends the answer to command `id`.
    pub(super) fn answer(&mut self, now: Micros, id: u16, result: Result<(), Refusal>) {
        self.send(&FromBoard::Answer(Answer { id, refusal: result.err(), time: now }));
    }

    /// Makes frames of the messages that wait.
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

    /// Checks whether there is nothing to send.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.bytes.is_empty()
    }

    /// Returns the bytes to send, oldest first.
    pub fn bytes(&mut self) -> &[u8] {
        self.frame();
        &self.bytes
    }

    /// Empties the queue, after its bytes were sent.
    pub fn clear(&mut self) {
        self.waiting.clear();
        self.bytes.clear();
    }

    /// Returns the number of messages that did not fit, since the start.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}
