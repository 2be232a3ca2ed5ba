//! UART0 at 115 200 baud on GP0 and GP1.

use embassy_rp::peripherals::{PIN_0, PIN_1, UART0};
use embassy_rp::uart::{BufferedUart, BufferedUartRx, BufferedUartTx, Config, Error};
use embassy_rp::{Peri, pac};
use embedded_io_async::{Read, Write};
use static_cell::StaticCell;

use super::arbiter::{LinkReceiver, Port, SharedArbiter};
use crate::interrupts::Interrupts;
use crate::pins;

/// Sets up the port.
pub(super) fn set_up(
    uart: Peri<'static, UART0>,
    tx: Peri<'static, PIN_0>,
    rx: Peri<'static, PIN_1>,
) -> (BufferedUartTx, BufferedUartRx) {
    static OUT: StaticCell<[u8; 256]> = StaticCell::new();
    static IN: StaticCell<[u8; 256]> = StaticCell::new();
    let port = BufferedUart::new(
        uart,
        tx,
        rx,
        Interrupts,
        OUT.init([0; 256]),
        IN.init([0; 256]),
        Config::default(),
    );
    // The pull-up keeps the line idle while nothing is connected.
    pac::PADS_BANK0.gpio(usize::from(pins::UART_RX)).modify(|w| w.set_pue(true));
    port.split()
}

/// Passes received bytes on.
#[embassy_executor::task]
pub(super) async fn receive(mut port: BufferedUartRx, arbiter: SharedArbiter) {
    let mut receiver = LinkReceiver::new(Port::Uart, arbiter);
    let mut bytes = [0; 64];
    loop {
        // The frame's CRC detects bytes that the UART reports as damaged.
        if let Ok(count) = port.read(&mut bytes).await {
            receiver.receive(&bytes[..count]).await;
        }
    }
}

/// Writes all bytes.
pub(super) async fn write(port: &mut BufferedUartTx, bytes: &[u8]) -> Result<(), Error> {
    port.write_all(bytes).await
}
