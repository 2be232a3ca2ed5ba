//! The links to the host: bytes from USB or UART to the board and back.
//!
//! Whichever speaks first is the master and gets what the board says, until it is unplugged, or has
//! been silent for [`SILENT`] and the other speaks. What the board says to nobody is dropped. No
//! write waits for longer than [`WRITE`], and none of this is ever waited for by the stepping.

mod uart;
mod usb;

use embassy_executor::Spawner;
use embassy_rp::Peri;
use embassy_rp::peripherals::{PIN_0, PIN_1, UART0, USB};
use embassy_rp::uart::BufferedUartTx;
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, NoopRawMutex};
use embassy_sync::mutex::Mutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, Instant, Timer};
use heapless::spsc::{Consumer, Producer, Queue};
use plumb_protocol::ToBoard;
use plumb_protocol::frame::{self, Accumulator, FrameError};
use plumb_protocol::message::PositionCommand;
use static_cell::StaticCell;

use crate::spawn;

/// A master that has said nothing for so long may be replaced.
const SILENT: Duration = Duration::from_secs(1);
/// A write that takes so long is given up.
const WRITE: Duration = Duration::from_millis(100);

/// What a frame from the host has turned out to be. That is found out here, where it delays no
/// step.
#[derive(Clone, Copy)]
pub(crate) enum Message {
    /// A position.
    Position(PositionCommand),
    /// Another one: the next of [`Inbox::commands`]. Apart, since the largest of them is five times
    /// a position.
    Command,
    Damaged(FrameError),
}
/// Messages that wait for the board, one less: the stepping takes one every 200 µs.
const WAITING: usize = 8;

/// What the stepping takes the host's messages from.
pub(crate) struct Inbox {
    /// In their order.
    pub(crate) messages: Consumer<'static, Message>,
    pub(crate) commands: Consumer<'static, ToBoard>,
}

/// Where they are put.
pub(crate) struct ToInbox {
    messages: Producer<'static, Message>,
    commands: Producer<'static, ToBoard>,
}

impl ToInbox {
    /// Puts in what a frame was found to be. There is room for a command where there is for a
    /// message: it is taken out first.
    fn put(&mut self, found: Result<&[u8], FrameError>) {
        let message = match found.map(ToBoard::position) {
            Ok(Some(position)) => Message::Position(position),
            Ok(None) => self.put_command(found),
            Err(error) => Message::Damaged(error),
        };
        let _ = self.messages.enqueue(message);
    }

    #[inline(never)]
    fn put_command(&mut self, found: Result<&[u8], FrameError>) -> Message {
        match found.and_then(frame::read) {
            Ok(command) => {
                let _ = self.commands.enqueue(command);
                Message::Command
            }
            Err(error) => Message::Damaged(error),
        }
    }
}

/// What the board says, on its way to the master.
static OUTBOX: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();

/// What the links take of the chip.
pub(crate) struct Parts {
    pub(crate) usb: Peri<'static, USB>,
    pub(crate) uart: Peri<'static, UART0>,
    pub(crate) tx: Peri<'static, PIN_0>,
    pub(crate) rx: Peri<'static, PIN_1>,
    pub(crate) to_board: ToInbox,
}

/// One of the links.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Source {
    Usb,
    Uart,
}

/// Who is listened to, and the way to the board.
struct Desk {
    to_board: ToInbox,
    /// The frame that is coming in.
    accumulator: Accumulator,
    master: Option<(Source, Instant)>,
}

/// Shared by the tasks of this module alone, all of which are of one executor.
type SharedDesk = &'static Mutex<NoopRawMutex, Desk>;

/// Where the host's messages go in, and where they come out; once.
pub(crate) fn queue() -> (ToInbox, Inbox) {
    static MESSAGES: StaticCell<Queue<Message, WAITING>> = StaticCell::new();
    static COMMANDS: StaticCell<Queue<ToBoard, WAITING>> = StaticCell::new();
    let (to_messages, messages) = MESSAGES.init(Queue::new()).split();
    let (to_commands, commands) = COMMANDS.init(Queue::new()).split();
    (ToInbox { messages: to_messages, commands: to_commands }, Inbox { messages, commands })
}

/// Sets the links up and starts their tasks.
pub(crate) fn start(spawner: Spawner, parts: Parts) {
    static DESK: StaticCell<Mutex<NoopRawMutex, Desk>> = StaticCell::new();
    let desk: SharedDesk = DESK.init(Mutex::new(Desk {
        to_board: parts.to_board,
        accumulator: Accumulator::new(),
        master: None,
    }));
    let (usb_out, usb_in, control) = usb::set_up(spawner, parts.usb);
    let (uart_out, uart_in) = uart::set_up(parts.uart, parts.tx, parts.rx);
    spawn(spawner, usb::receive(usb_in, desk));
    spawn(spawner, usb::watch_port(control, desk));
    spawn(spawner, uart::receive(uart_in, desk));
    spawn(spawner, transmit(usb_out, uart_out, desk));
}

/// Sends what the board says to the master.
#[embassy_executor::task]
async fn transmit(mut usb: usb::Out, mut uart: BufferedUartTx, desk: SharedDesk) {
    let mut packet = [0; usb::PACKET];
    loop {
        let count = OUTBOX.read(&mut packet).await;
        let master = desk.lock().await.master.map(|(source, _)| source);
        match master {
            Some(Source::Usb) => {
                usb::write(&mut usb, &packet[..count], OUTBOX.is_empty(), desk).await
            }
            Some(Source::Uart) => uart::write(&mut uart, &packet[..count]).await,
            None => {}
        }
    }
}

/// Sends whole frames to the master; they are dropped whole where there is no room. For the
/// stepping: never waits.
pub(crate) fn send(mut frames: &[u8]) {
    if OUTBOX.free_capacity() < frames.len() {
        return;
    }
    // There is room for all of it, since nothing else writes; in two pieces where the ring closes.
    while !frames.is_empty()
        && let Ok(written) = OUTBOX.try_write(frames)
    {
        frames = &frames[written..];
    }
}

/// Hands on what a link has heard, waiting for room; nothing, where the other is the master.
async fn heard(desk: SharedDesk, source: Source, mut bytes: &[u8]) {
    let mut desk = desk.lock().await;
    if !desk.admits(source) {
        return;
    }
    while !bytes.is_empty() {
        while !desk.to_board.messages.ready() {
            Timer::after_millis(1).await;
        }
        let Desk { accumulator, to_board, .. } = &mut *desk;
        if let Some(found) = accumulator.take(&mut bytes) {
            to_board.put(found);
        }
    }
}

/// The link is gone.
async fn lost(desk: SharedDesk, source: Source) {
    let mut desk = desk.lock().await;
    desk.master.take_if(|(master, _)| *master == source);
}

impl Desk {
    /// Whether `source`, which has just spoken, is the master; it becomes that where there is none.
    fn admits(&mut self, source: Source) -> bool {
        let now = Instant::now();
        let admitted =
            self.master.is_none_or(|(master, spoke)| master == source || now - spoke > SILENT);
        if admitted {
            self.master = Some((source, now));
        }
        admitted
    }
}
