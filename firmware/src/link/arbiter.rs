//! The way from the links to the stepping interrupt: arbitration between USB and UART, and the
//! inbox of their messages.
//!
//! The link that receives an intact frame first becomes the master: it alone exchanges messages
//! with the board. It stays the master until it is disconnected, or until it has received no intact
//! frame for [`MASTER_TIMEOUT`] and the other link receives one. Noise makes no master.

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, Instant, Timer};
use heapless::spsc::{Consumer, Producer, Queue};
use plumb_protocol::ToBoard;
use plumb_protocol::frame::{Accumulator, FrameError};
use plumb_protocol::message::{PositionCommand, Request};
use static_cell::StaticCell;

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

/// Capacity of each queue plus one. The stepping takes one message every 200 µs.
const QUEUE_LENGTH: usize = 8;

/// A frame from the host, decoded by the links' tasks, where decoding delays no step.
#[derive(Clone, Copy)]
pub(crate) enum Message {
    Position(PositionCommand),
    /// Any other command: the next of [`Inbox::commands`]. It has a queue of its own, since the
    /// largest command is five times as large as a position.
    Command,
    /// A frame that was damaged or is no message.
    Damaged(FrameError),
}

/// The stepping's end of the inbox.
pub(crate) struct Inbox {
    /// Messages in their order.
    pub(crate) messages: Consumer<'static, Message>,
    /// The commands among them.
    pub(crate) commands: Consumer<'static, Request>,
}

/// The links' end of the inbox.
pub(crate) struct InboxWriter {
    messages: Producer<'static, Message>,
    commands: Producer<'static, Request>,
}

/// Creates the inbox; call once.
pub(crate) fn inbox() -> (InboxWriter, Inbox) {
    static MESSAGES: StaticCell<Queue<Message, QUEUE_LENGTH>> = StaticCell::new();
    static COMMANDS: StaticCell<Queue<Request, QUEUE_LENGTH>> = StaticCell::new();
    let (message_writer, messages) = MESSAGES.init(Queue::new()).split();
    let (command_writer, commands) = COMMANDS.init(Queue::new()).split();
    let writer = InboxWriter { messages: message_writer, commands: command_writer };
    (writer, Inbox { messages, commands })
}

impl InboxWriter {
    /// Returns whether there is room for a message.
    fn ready(&self) -> bool {
        self.messages.ready()
    }

    /// Puts in a decoded frame. Where there is room for a message, there is room for a command: the
    /// stepping takes the command out first.
    fn put(&mut self, frame: Result<&[u8], FrameError>) {
        let message = match frame.map(ToBoard::position) {
            Ok(Some(position)) => Message::Position(position),
            Ok(None) => self.put_command(frame),
            Err(error) => Message::Damaged(error),
        };
        let _ = self.messages.enqueue(message);
    }

    /// Puts in a command. There is room for it where there is room for a message.
    fn put_decoded(&mut self, message: ToBoard) {
        let _ = self.commands.enqueue(Request { message, crc: 0 });
        let _ = self.messages.enqueue(Message::Command);
    }

    #[inline(never)]
    fn put_command(&mut self, frame: Result<&[u8], FrameError>) -> Message {
        match frame.and_then(Request::read) {
            Ok(command) => {
                let _ = self.commands.enqueue(command);
                Message::Command
            }
            Err(error) => Message::Damaged(error),
        }
    }
}
