//! Arbitration between USB and UART.
//!
//! The link that receives a byte first becomes the master: it alone exchanges messages with the
//! board. It stays the master until it is disconnected, or until it has been silent for
//! [`MASTER_TIMEOUT`] and the other link receives a byte.

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, Instant, Timer};
use plumb_protocol::frame::Accumulator;

use super::inbox::InboxWriter;

/// Time without a byte after which the other link may become the master.
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
    /// Decoder of the frame that is coming in.
    accumulator: Accumulator,
    /// The master, and when it received the last bytes.
    master: Option<(Port, Instant)>,
}

/// The arbiter, shared by the links' tasks, which run in one executor.
pub(super) type SharedArbiter = &'static Mutex<NoopRawMutex, LinkArbiter>;

impl LinkArbiter {
    /// Creates an arbiter without a master.
    pub(super) fn new(inbox: InboxWriter) -> Self {
        Self { inbox, accumulator: Accumulator::new(), master: None }
    }

    /// Returns the master.
    pub(super) fn master(&self) -> Option<Port> {
        self.master.map(|(port, _)| port)
    }

    /// Returns whether `port`, which has just received bytes, is the master or becomes it.
    fn admits(&mut self, port: Port) -> bool {
        let now = Instant::now();
        let admitted = self
            .master
            .is_none_or(|(master, last_rx)| master == port || now - last_rx > MASTER_TIMEOUT);
        if admitted {
            self.master = Some((port, now));
        }
        admitted
    }
}

/// Decodes bytes that `port` has received, and puts their messages into the inbox, waiting for
/// room. Bytes of a link that is not the master are dropped.
pub(super) async fn receive(arbiter: SharedArbiter, port: Port, mut bytes: &[u8]) {
    let mut arbiter = arbiter.lock().await;
    if !arbiter.admits(port) {
        return;
    }
    while !bytes.is_empty() {
        while !arbiter.inbox.ready() {
            Timer::after_millis(1).await;
        }
        let LinkArbiter { accumulator, inbox, .. } = &mut *arbiter;
        if let Some(frame) = accumulator.take(&mut bytes) {
            inbox.put(frame);
        }
    }
}

/// Records that `port` is disconnected.
pub(super) async fn disconnect(arbiter: SharedArbiter, port: Port) {
    let mut arbiter = arbiter.lock().await;
    arbiter.master.take_if(|(master, _)| *master == port);
}
