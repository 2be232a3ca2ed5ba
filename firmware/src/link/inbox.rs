//! The inbox: messages from the links to the stepping interrupt.

use heapless::spsc::{Consumer, Producer, Queue};
use plumb_protocol::ToBoard;
use plumb_protocol::frame::{self, FrameError};
use plumb_protocol::message::PositionCommand;
use static_cell::StaticCell;

/// Capacity of each queue plus one. The stepping takes one message every 200 µs.
const QUEUE_LENGTH: usize = 8;

/// A frame from the host, decoded by the links' tasks, where decoding delays no step.
#[derive(Clone, Copy)]
pub(crate) enum Message {
    /// A position.
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
    pub(crate) commands: Consumer<'static, ToBoard>,
}

/// The links' end of the inbox.
pub(crate) struct InboxWriter {
    messages: Producer<'static, Message>,
    commands: Producer<'static, ToBoard>,
}

/// Creates the inbox; call once.
pub(crate) fn inbox() -> (InboxWriter, Inbox) {
    static MESSAGES: StaticCell<Queue<Message, QUEUE_LENGTH>> = StaticCell::new();
    static COMMANDS: StaticCell<Queue<ToBoard, QUEUE_LENGTH>> = StaticCell::new();
    let (message_writer, messages) = MESSAGES.init(Queue::new()).split();
    let (command_writer, commands) = COMMANDS.init(Queue::new()).split();
    let writer = InboxWriter { messages: message_writer, commands: command_writer };
    (writer, Inbox { messages, commands })
}

impl InboxWriter {
    /// Returns whether there is room for a message.
    pub(super) fn ready(&self) -> bool {
        self.messages.ready()
    }

    /// Puts in a decoded frame. Where there is room for a message, there is room for a command: the
    /// stepping takes the command out first.
    pub(super) fn put(&mut self, frame: Result<&[u8], FrameError>) {
        let message = match frame.map(ToBoard::position) {
            Ok(Some(position)) => Message::Position(position),
            Ok(None) => self.put_command(frame),
            Err(error) => Message::Damaged(error),
        };
        let _ = self.messages.enqueue(message);
    }

    /// Puts in a command. There is room for it where there is room for a message.
    pub(super) fn put_decoded(&mut self, command: ToBoard) {
        let _ = self.commands.enqueue(command);
        let _ = self.messages.enqueue(Message::Command);
    }

    #[inline(never)]
    fn put_command(&mut self, frame: Result<&[u8], FrameError>) -> Message {
        match frame.and_then(frame::read) {
            Ok(command) => {
                let _ = self.commands.enqueue(command);
                Message::Command
            }
            Err(error) => Message::Damaged(error),
        }
    }
}
