//! USB-CDC: a serial port to any computer, without a driver.

pub(crate) mod errata;

use embassy_executor::Spawner;
use embassy_futures::select::{Either, select};
use embassy_rp::Peri;
use embassy_rp::peripherals::USB;
use embassy_rp::usb::Driver;
use embassy_time::Timer;
use embassy_usb::class::cdc_acm::{CdcAcmClass, ControlChanged, Receiver, Sender, State};
use embassy_usb::driver::EndpointError;
use embassy_usb::{Builder, Config, UsbDevice};
use plumb_protocol::RELEASE;
use static_cell::{ConstStaticCell, StaticCell};

use super::arbiter::{self, LinkReceiver, Port, SharedArbiter};
use super::reset;
use crate::chip::USB_PRODUCT;
use crate::interrupts::{Interrupts, spawn};
use errata::{PERIOD, Supervisor};

type Usb = Driver<'static, USB>;
pub(super) type Out = Sender<'static, Usb>;
pub(super) type In = Receiver<'static, Usb>;
pub(super) type ControlLines = ControlChanged<'static>;

/// Largest packet at full speed, bytes.
pub(super) const PACKET: usize = 64;

/// Vendor id of Raspberry Pi.
const VENDOR: u16 = 0x2e8a;
/// Release number of the device (bcdDevice): the version as decimal digits 0xMMmp, with two digits
/// for the major version and one each for minor and patch.
const DEVICE_RELEASE: u16 = {
    let [major, minor, patch] = RELEASE.0;
    assert!(major <= 99 && minor <= 9 && patch <= 9, "the version does not fit bcdDevice");
    let major = ((major / 10) << 4) + major % 10;
    (major as u16) << 8 | (minor as u16) << 4 | patch as u16
};

/// Sets up the port of the board with the unique number `id`.
pub(super) fn set_up(
    spawner: Spawner,
    usb: Peri<'static, USB>,
    id: Option<[u8; 8]>,
) -> (Out, In, ControlLines) {
    static DESCRIPTOR: ConstStaticCell<[u8; 128]> = ConstStaticCell::new([0; 128]);
    static STRINGS: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);
    static CONTROL: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);
    static STATE: StaticCell<State> = StaticCell::new();
    let mut config = Config::new(VENDOR, USB_PRODUCT);
    config.manufacturer = Some("Plumb");
    config.product = Some("Plumb board");
    config.serial_number = id.and_then(serial_number);
    config.device_release = DEVICE_RELEASE;
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
    reset::add(&mut builder);
    spawn(spawner, run(builder.build()));
    errata::look_at_next();
    class.split_with_control()
}

/// Returns `id` in hexadecimal digits, as the Pico SDK writes it.
fn serial_number(id: [u8; 8]) -> Option<&'static str> {
    static DIGITS: ConstStaticCell<[u8; 16]> = ConstStaticCell::new([0; 16]);
    let digits = DIGITS.take();
    for (digit, place) in digits.iter_mut().zip(0..) {
        let nibble = (u64::from_be_bytes(id) >> (60 - 4 * place)) as u8 & 15;
        *digit = if nibble < 10 { b'0' + nibble } else { b'A' - 10 + nibble };
    }
    core::str::from_utf8(digits).ok()
}

/// Runs the USB device.
#[embassy_executor::task]
async fn run(mut device: UsbDevice<'static, Usb>) {
    device.run().await;
}

/// Passes received bytes on.
#[embassy_executor::task]
pub(super) async fn receive(mut port: In, arbiter: SharedArbiter) {
    let mut receiver = LinkReceiver::new(Port::Usb, arbiter);
    let mut packet = [0; PACKET];
    loop {
        port.wait_connection().await;
        while let Ok(count) = port.read_packet(&mut packet).await {
            receiver.receive(&packet[..count]).await;
        }
        receiver.disconnect().await;
    }
}

/// Disconnects the link when the host's program closes the port, and when the controller hangs and
/// is reset.
#[embassy_executor::task]
pub(super) async fn watch(port: ControlLines, arbiter: SharedArbiter) {
    let mut supervisor = Supervisor::default();
    loop {
        let is_lost = match select(port.control_changed(), Timer::after(PERIOD)).await {
            Either::First(()) => !port.dtr(),
            Either::Second(()) => supervisor.hangs(port.dtr()) && supervisor.reset().await,
        };
        if is_lost {
            arbiter::disconnect(arbiter, Port::Usb).await;
        }
    }
}

/// Writes a packet of up to 64 bytes. A packet of 64 bytes announces another one; where it is the
/// `last`, an empty packet follows.
pub(super) async fn write(port: &mut Out, packet: &[u8], last: bool) -> Result<(), EndpointError> {
    errata::until_offer().await;
    port.write_packet(packet).await?;
    if last && packet.len() == PACKET {
        errata::until_offer().await;
        port.write_packet(&[]).await?;
    }
    Ok(())
}
