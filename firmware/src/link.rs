//! The links to the host: bytes from USB or UART to the board and back.
//!
//! Whichever speaks first is the master and gets what the board says, until it is unplugged, or has been silent for
//! [`SILENT`] and the other speaks. What the board says to nobody is dropped. No write waits for longer than
//! [`WRITE`], and none of this is ever waited for by the stepping.

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
use static_cell::StaticCell;

use crate::spawn;

/// A master that has said nothing for so long may be replaced.
const SILENT: Duration = Duration::from_secs(1);
/// A write that takes so long is given up.
const WRITE: Duration = Duration::from_millis(100);
/// Bytes from the host that wait for the board: the stepping takes up to 64 every 200 µs.
const WAITING: usize = 1024;

/// What the stepping takes the host's bytes from.
pub(crate) type Inbox = Consumer<'static, u8>;

/// What the board says, on its way to the master.
static OUTBOX: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();

/// What the links take of the chip.
pub(crate) struct Parts {
    pub(crate) usb: Peri<'static, USB>,
    pub(crate) uart: Peri<'static, UART0>,
    pub(crate) tx: Peri<'static, PIN_0>,
    pub(crate) rx: Peri<'static, PIN_1>,
    pub(crate) to_board: Producer<'static, u8>,
}

/// One of the links.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Source {
    Usb,
    Uart,
}

/// Who is listened to, and the way to the board.
struct Desk {
    to_board: Producer<'static, u8>,
    master: Option<(Source, Instant)>,
}

/// Shared by the tasks of this module alone, all of which are of one executor.
type SharedDesk = &'static Mutex<NoopRawMutex, Desk>;

/// Where the host's bytes go in, and where they come out; once.
pub(crate) fn queue() -> (Producer<'static, u8>, Inbox) {
    static QUEUE: StaticCell<Queue<u8, WAITING>> = StaticCell::new();
    QUEUE.init(Queue::new()).split()
}

/// Sets the links up and starts their tasks.
pub(crate) fn start(spawner: Spawner, parts: Parts) {
    static DESK: StaticCell<Mutex<NoopRawMutex, Desk>> = StaticCell::new();
    let desk: SharedDesk = DESK.init(Mutex::new(Desk { to_board: parts.to_board, master: None }));
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
            Some(Source::Usb) => usb::write(&mut usb, &packet[..count], OUTBOX.is_empty(), desk).await,
            Some(Source::Uart) => uart::write(&mut uart, &packet[..count]).await,
            None => {}
        }
    }
}

/// Sends whole frames to the master; they are dropped whole where there is no room. For the stepping: never waits.
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
async fn heard(desk: SharedDesk, source: Source, bytes: &[u8]) {
    let mut desk = desk.lock().await;
    if !desk.admits(source) {
        return;
    }
    for &byte in bytes {
        while desk.to_board.enqueue(byte).is_err() {
            Timer::after_millis(1).await;
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
        let admitted = self.master.is_none_or(|(master, spoke)| master == source || now - spoke > SILENT);
        if admitted {
            self.master = Some((source, now));
        }
        admitted
    }
}
