//! USB-CDC: a serial port to any computer, without a driver.

use embassy_executor::Spawner;
use embassy_rp::Peri;
use embassy_rp::peripherals::USB;
use embassy_rp::usb::Driver;
use embassy_time::with_timeout;
use embassy_usb::class::cdc_acm::{CdcAcmClass, ControlChanged, Receiver, Sender, State};
use embassy_usb::{Builder, Config, UsbDevice};
use static_cell::{ConstStaticCell, StaticCell};

use super::{SharedDesk, Source, WRITE, heard, lost};
use crate::{Interrupts, spawn};

type Usb = Driver<'static, USB>;
pub(super) type Out = Sender<'static, Usb>;
pub(super) type In = Receiver<'static, Usb>;
pub(super) type Port = ControlChanged<'static>;

/// Bytes of the largest packet at full speed.
pub(super) const PACKET: usize = 64;

/// Raspberry Pi's vendor number and that of a Pico's serial port, which they let anyone use.
const VENDOR: u16 = 0x2e8a;
const PRODUCT: u16 = 0x000a;

/// Sets the port up.
pub(super) fn set_up(spawner: Spawner, usb: Peri<'static, USB>) -> (Out, In, Port) {
    static DESCRIPTOR: ConstStaticCell<[u8; 128]> = ConstStaticCell::new([0; 128]);
    static STRINGS: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);
    static CONTROL: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);
    static STATE: StaticCell<State> = StaticCell::new();
    let mut config = Config::new(VENDOR, PRODUCT);
    config.manufacturer = Some("Plumb");
    config.product = Some("Plumb board");
    config.max_packet_size_0 = PACKET as u8;
    let mut builder = Builder::new(
        Driver::new(usb, Interrupts),
        config,
        DESCRIPTOR.take(),
        STRINGS.take(),
        &mut [],
        CONTROL.take(),
    );
    let class = CdcAcmClass::new(&mut builder, STATE.init(State::new()), PACKET as u16);
    spawn(spawner, run(builder.build()));
    class.split_with_control()
}

/// Answers the computer's questions about the port.
#[embassy_executor::task]
async fn run(mut device: UsbDevice<'static, Usb>) {
    device.run().await;
}

/// Hands on what comes.
#[embassy_executor::task]
pub(super) async fn receive(mut port: In, desk: SharedDesk) {
    let mut packet = [0; PACKET];
    loop {
        port.wait_connection().await;
        while let Ok(count) = port.read_packet(&mut packet).await {
            heard(desk, Source::Usb, &packet[..count]).await;
        }
        lost(desk, Source::Usb).await;
    }
}

/// Notices that the program on the other side has closed the port.
#[embassy_executor::task]
pub(super) async fn watch_port(port: Port, desk: SharedDesk) {
    loop {
        port.control_changed().await;
        if !port.dtr() {
            lost(desk, Source::Usb).await;
        }
    }
}

/// Writes a packet of up to 64 bytes. One of exactly 64 says that more is to come: where nothing is
/// (`last`), an empty one says so.
pub(super) async fn write(port: &mut Out, packet: &[u8], last: bool, desk: SharedDesk) {
    let whole = async {
        port.write_packet(packet).await?;
        if last && packet.len() == PACKET { port.write_packet(&[]).await } else { Ok(()) }
    };
    if !matches!(with_timeout(WRITE, whole).await, Ok(Ok(()))) {
        lost(desk, Source::Usb).await;
    }
}
