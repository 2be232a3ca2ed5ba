//! Reset interface of the Pico SDK: by it picotool (`-f`) restarts a board that runs, into its
//! bootloader or into its program. Numbers as in the SDK: pico_usb_reset_interface.h, and
//! pico_stdio_usb/reset_interface.c for the requests.
//!
//! A request becomes the board's own command Bootloader, so that the motors ramp down and the
//! drivers are off before the chip restarts.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Timer;
use embassy_usb::Builder;
use embassy_usb::control::{OutResponse, Recipient, Request, RequestType};
use embassy_usb::driver::Driver;
use embassy_usb::types::InterfaceNumber;
use plumb_protocol::ToBoard;
use plumb_protocol::message::Command;
use static_cell::StaticCell;

use super::arbiter::{self, SharedArbiter};
use crate::restart;

/// Class of the interface: the vendor's own.
const CLASS: u8 = 0xff;
const SUBCLASS: u8 = 0x00;
const PROTOCOL: u8 = 0x01;
/// Request to restart into the bootloader.
const BOOTSEL: u8 = 0x01;
/// Request to restart the program.
const FLASH: u8 = 0x02;
/// Bit of a request's value: bits 9 to 15 are the number of a pin that shows activity.
const HAS_PIN: u16 = 0x100;
/// Bits of a request's value: interfaces of the bootloader that stay off.
const DISABLED: u16 = 0x7f;

/// Id of the command that a request becomes. Hosts use others.
const COMMAND_ID: u16 = 0;
/// Time for the host to see that its request was accepted.
const DELAY_MS: u64 = 10;

/// A request has come.
static REQUESTED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Value of the last request: that of [`BOOTSEL`], or [`TO_PROGRAM`].
static LAST: AtomicU32 = AtomicU32::new(0);
const TO_PROGRAM: u32 = 1 << 16;

/// Handler of the interface's requests.
struct ResetHandler {
    interface: InterfaceNumber,
}

/// Adds the interface to the device.
pub(super) fn add<D: Driver<'static>>(builder: &mut Builder<'static, D>) {
    static HANDLER: StaticCell<ResetHandler> = StaticCell::new();
    let mut function = builder.function(CLASS, SUBCLASS, PROTOCOL);
    let mut interface = function.interface();
    let number = interface.interface_number();
    interface.alt_setting(CLASS, SUBCLASS, PROTOCOL, None);
    drop(function);
    builder.handler(HANDLER.init(ResetHandler { interface: number }));
}

impl embassy_usb::Handler for ResetHandler {
    fn control_out(&mut self, request: Request, _: &[u8]) -> Option<OutResponse> {
        let is_ours = request.request_type == RequestType::Class
            && request.recipient == Recipient::Interface
            && request.index == u16::from(self.interface.0);
        let last = match request.request {
            _ if !is_ours => return None,
            BOOTSEL => u32::from(request.value),
            FLASH => TO_PROGRAM,
            _ => return Some(OutResponse::Rejected),
        };
        LAST.store(last, Ordering::Relaxed);
        REQUESTED.signal(());
        Some(OutResponse::Accepted)
    }
}

/// Passes the requests on to the board.
#[embassy_executor::task]
pub(super) async fn pass_on(arbiter: SharedArbiter) {
    loop {
        REQUESTED.wait().await;
        Timer::after_millis(DELAY_MS).await;
        arbiter::put(arbiter, ToBoard { id: COMMAND_ID, command: Command::Bootloader }).await;
    }
}

/// Restarts the chip as the last request says; without one, into the bootloader.
pub(crate) fn restart() -> ! {
    let last = LAST.load(Ordering::Relaxed);
    if last == TO_PROGRAM {
        restart::program();
    }
    let value = last as u16;
    let pin = u32::from(value >> 9);
    let pins = if value & HAS_PIN == 0 { 0 } else { 1_u32.checked_shl(pin).unwrap_or(0) };
    restart::bootloader(pins, u32::from(value & DISABLED))
}
