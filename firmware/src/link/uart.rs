//! UART0 at 115 200 baud on GP0 and GP1.

use embassy_rp::peripherals::{PIN_0, PIN_1, UART0};
use embassy_rp::uart::{BufferedUart, BufferedUartRx, BufferedUartTx, Config};
use embassy_rp::{Peri, pac};
use embassy_time::with_timeout;
use embedded_io_async::{Read, Write};
use static_cell::StaticCell;

use super::{SharedDesk, Source, WRITE, heard};
use crate::{Interrupts, pins};

/// Sets the port up.
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
    // With nothing plugged in the line is to be idle, not noise.
    pac::PADS_BANK0.gpio(usize::from(pins::UART_RX)).modify(|w| w.set_pue(true));
    port.split()
}

/// Hands on what comes.
#[embassy_executor::task]
pub(super) async fn receive(mut port: BufferedUartRx, desk: SharedDesk) {
    let mut bytes = [0; 64];
    loop {
        // What was damaged on the way is found by its CRC.
        if let Ok(count) = port.read(&mut bytes).await {
            heard(desk, Source::Uart, &bytes[..count]).await;
        }
    }
}

/// Writes all of it, if that is possible in time.
pub(super) async fn write(port: &mut BufferedUartTx, bytes: &[u8]) {
    let _ = with_timeout(WRITE, port.write_all(bytes)).await;
}
