//! The links to the host: bytes from USB or UART to the board and back.
//!
//! One link at a time is the [master](arbiter). It gets the board's frames; without a master they
//! are dropped. A write is given up after [`WRITE_TIMEOUT`]. The stepping interrupt never waits for
//! a link.

mod arbiter;
pub(crate) mod reset;
mod uart;
pub(crate) mod usb;

use embassy_executor::Spawner;
use embassy_rp::Peri;
use embassy_rp::peripherals::{PIN_0, PIN_1, UART0, USB};
use embassy_rp::uart::BufferedUartTx;
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, NoopRawMutex};
use embassy_sync::mutex::Mutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, with_timeout};
use static_cell::StaticCell;

use crate::diagnostics;
use crate::interrupts::spawn;
use arbiter::{InboxWriter, LinkArbiter, Port, SharedArbiter};

pub(crate) use arbiter::{Inbox, Message, inbox};
pub(crate) use usb::errata::set_moving;

/// Time after which a write is given up.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);

/// Frames from the board, on their way to the master. Size in bytes.
static OUTBOX: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();

/// Bytes that are taken from the outbox at once: interrupts are off meanwhile, for 12 clocks a
/// byte.
const PIECE: usize = 16;

pub(crate) struct LinkResources {
    pub(crate) usb: Peri<'static, USB>,
    pub(crate) uart: Peri<'static, UART0>,
    pub(crate) tx: Peri<'static, PIN_0>,
    pub(crate) rx: Peri<'static, PIN_1>,
    pub(crate) inbox: InboxWriter,
    /// Unique number of the board, where it is known.
    pub(crate) id: Option<[u8; 8]>,
}

/// Sets up the links, and starts their tasks.
pub(crate) fn start(spawner: Spawner, resources: LinkResources) {
    static ARBITER: StaticCell<Mutex<NoopRawMutex, LinkArbiter>> = StaticCell::new();
    let LinkResources { usb, uart, tx, rx, inbox, id } = resources;
    let arbiter: SharedArbiter = ARBITER.init(Mutex::new(LinkArbiter::new(inbox)));
    let (usb_out, usb_in, control) = usb::set_up(spawner, usb, id);
    let (uart_out, uart_in) = uart::set_up(uart, tx, rx);
    spawn(spawner, usb::receive(usb_in, arbiter));
    spawn(spawner, usb::watch(control, arbiter));
    spawn(spawner, reset::pass_on(arbiter));
    spawn(spawner, uart::receive(uart_in, arbiter));
    spawn(spawner, transmit(usb_out, uart_out, arbiter));
}

/// Sends the board's frames to the master.
#[embassy_executor::task]
async fn transmit(mut usb: usb::Out, mut uart: BufferedUartTx, arbiter: SharedArbiter) {
    let mut packet = [0; usb::PACKET];
    loop {
        let mut count = OUTBOX.read(&mut packet[..PIECE]).await;
        while let Some(rest) = packet[count..].chunks_mut(PIECE).next()
            && let Ok(more) = OUTBOX.try_read(rest)
        {
            count += more;
        }
        let packet = &packet[..count];
        let master = arbiter.lock().await.master();
        match master {
            Some(Port::Usb) => {
                let write = usb::write(&mut usb, packet, OUTBOX.is_empty());
                if !matches!(with_timeout(WRITE_TIMEOUT, write).await, Ok(Ok(()))) {
                    arbiter::disconnect(arbiter, Port::Usb).await;
                }
            }
            Some(Port::Uart) => {
                let _ = with_timeout(WRITE_TIMEOUT, uart::write(&mut uart, packet)).await;
            }
            None => {}
        }
    }
}

/// Sends whole frames to the master, or drops and counts them where there is no room. Called by the
/// stepping interrupt; never waits.
pub(crate) fn send(mut frames: &[u8]) {
    if OUTBOX.free_capacity() < frames.len() {
        let count = frames.iter().filter(|byte| **byte == 0).count();
        diagnostics::count_dropped_frames(count as u32);
        return;
    }
    // Nothing else writes, so there is room. The ring buffer takes the bytes in two parts where it
    // wraps.
    while !frames.is_empty()
        && let Ok(written) = OUTBOX.try_write(frames)
    {
        frames = &frames[written..];
    }
}
