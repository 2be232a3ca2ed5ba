//! Arbitration between USB and UART.
//!
//! The link that receives an intact frame first becomes the master: it alone exchanges messages
//! with the board. It stays the master until it is disconnected, or until it has received no intact
//! frame for [`MASTER_TIMEOUT`] and the other link receives one. Noise makes no master.

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, Instant, Timer};
use plumb_protocol::ToBoard;
use plumb_protocol::frame::Accumulator;

use super::inbox::InboxWriter;

/// Time without an intact frame after which the other link may become the master.
const MASTER_TIMEOUT: Duration = Duration::from_secs(1);

/// One of the links.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Port {
    Usb,
    Uart,
}

/// State of the arbitration, and the way from the master to the board.
pub(super) struct LinkArbiter {
    inbox: InboxWriter,
    /// The master, and when it received the last intact frame.
    master: Option<(Port, Instant)>,
}

/// The arbiter, shared by the links' tasks, which run in one executor.
pub(super) type SharedArbiter = &'static Mutex<NoopRawMutex, LinkArbiter>;

impl LinkArbiter {
    /// Creates an arbiter without a master.
    pub(super) fn new(inbox: InboxWriter) -> Self {
        Self { inbox, master: None }
    }

    /// Returns the master.
    pub(super) fn master(&self) -> Option<Port> {
        self.master.map(|(port, _)| port)
    }

    /// Waits until the inbox has room for a message.
    async fn wait_for_room(&self) {
        while !self.inbox.ready() {
            Timer::after_millis(1).await;
        }
    }

    /// Returns whether `port`, which has just received a frame, is the master or becomes it.
    fn admits(&mut self, port: Port, is_intact: bool) -> bool {
        let now = Instant::now();
        let is_master = self.master() == Some(port);
        let is_free = self.master.is_none_or(|(_, last_rx)| now - last_rx > MASTER_TIMEOUT);
        if is_intact && (is_master || is_free) {
            self.master = Some((port, now));
        }
        self.master() == Some(port)
    }
}

/// Receiver of a link's bytes.
pub(super) struct LinkReceiver {
    port: Port,
    arbiter: SharedArbiter,
    /// Decoder of the frame that is coming in.
    accumulator: Accumulator,
}

impl LinkReceiver {
    /// Creates the receiver of `port`.
    pub(super) fn new(port: Port, arbiter: SharedArbiter) -> Self {
        Self { port, arbiter, accumulator: Accumulator::new() }
    }

    /// Decodes bytes that the link has received, and puts their messages into the inbox, waiting
    /// for room. Frames of a link that is not the master are dropped.
    pub(super) async fn receive(&mut self, mut bytes: &[u8]) {
        let mut arbiter = self.arbiter.lock().await;
        while !bytes.is_empty() {
            arbiter.wait_for_room().await;
            if let Some(frame) = self.accumulator.take(&mut bytes)
                && arbiter.admits(self.port, frame.is_ok())
            {
                arbiter.inbox.put(frame);
            }
        }
    }

    /// Records that the link is disconnected. A frame that was coming in is lost.
    pub(super) async fn disconnect(&mut self) {
        self.accumulator = Accumulator::new();
        disconnect(self.arbiter, self.port).await;
    }
}

/// Puts a command of the firmware itself into the inbox, waiting for room.
pub(super) async fn put(arbiter: SharedArbiter, command: ToBoard) {
    let mut arbiter = arbiter.lock().await;
    arbiter.wait_for_room().await;
    arbiter.inbox.put_decoded(command);
}

/// Records that `port` is disconnected.
pub(super) async fn disconnect(arbiter: SharedArbiter, port: Port) {
    let mut arbiter = arbiter.lock().await;
    arbiter.master.take_if(|(master, _)| *master == port);
}
