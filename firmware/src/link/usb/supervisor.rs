//! The supervisor of the USB controller: it resets a controller that hangs.
//!
//! A hanging controller (erratum E15, see [`super::frames`]) takes part in no transfer any more,
//! and no reset of the bus ends that (hathach/tinyusb, pull request 1779; embassy-rs/embassy, issue
//! 2880). So data that is offered stays offered, although the bus is in use. A reset takes the
//! board off the bus for a moment, and the host enumerates it anew. It comes at rest only: while
//! motors turn, the host's silence has ended a run long before.

use embassy_rp::pac;
use embassy_rp::pac::usb_dpram::regs::EpBufferControl;
use embassy_time::{Duration, Instant, Timer};

use super::frames::{self, DATA_IN};
use crate::{diagnostics, stepping};

/// Time between two looks.
pub(super) const PERIOD: Duration = Duration::from_millis(20);
/// Time without the end of a transfer after which the controller hangs.
const LIMIT: Duration = Duration::from_millis(100);
/// Time without a pull-up on the bus, for the host to find the board gone.
const DETACHED: Duration = Duration::from_millis(20);
/// Looks at the line in a row: 10 µs, three times as long as the packet that begins a frame.
const LINE_LOOKS: u32 = 128;
/// States of the line (SIE_STATUS.LINE_STATE).
const J: u8 = 1;
const K: u8 = 2;

/// State of the supervision.
#[derive(Default)]
pub(super) struct Supervisor {
    /// Number of the transfer that does not end, and since when the bus was in use beside it.
    pending: Option<(u32, Instant)>,
}

impl Supervisor {
    /// Looks at the controller, once in a [`PERIOD`]. Returns whether it hangs. `is_open`: a
    /// program has opened the port, so that the host takes data.
    pub(super) fn hangs(&mut self, is_open: bool) -> bool {
        frames::look_at_next();
        let is_configured = pac::USB_DPRAM.ep_in_control(DATA_IN - 1).read().enable();
        if !(is_open && is_configured && frames::is_offered()) {
            self.pending = None;
            return false;
        }
        let (now, transfer) = (Instant::now(), frames::ended());
        match self.pending.filter(|(number, _)| *number == transfer) {
            None => self.pending = Some((transfer, now)),
            Some((_, since)) => {
                return now - since >= LIMIT && (frames::come() || is_line_in_use());
            }
        }
        false
    }

    /// Resets the controller if the motors are at rest. Returns whether it did.
    pub(super) async fn reset(&mut self) -> bool {
        if stepping::moving() {
            return false;
        }
        self.pending = None;
        diagnostics::count_usb_reset();
        critical_section::with(|_| {
            pac::RESETS.reset().modify(|w| w.set_usbctrl(true));
            pac::RESETS.reset().modify(|w| w.set_usbctrl(false));
        });
        while !pac::RESETS.reset_done().read().usbctrl() {}
        let nothing = EpBufferControl(0);
        pac::USB_DPRAM.ep_in_buffer_control(0).write_value(nothing);
        pac::USB_DPRAM.ep_out_buffer_control(0).write_value(nothing);
        pac::USB_DPRAM.ep_in_buffer_control(DATA_IN).write_value(nothing);
        Timer::after(DETACHED).await;
        attach();
        true
    }
}

/// Returns whether packets are on the line, also those that the controller does not hear. Without
/// packets the line keeps one state: with no cable, with a host that sleeps, and while it wakes up.
fn is_line_in_use() -> bool {
    let states = (0..LINE_LOOKS).map(|_| pac::USB.sie_status().read().line_state());
    let seen = states.fold(0, |seen, state| seen | 1 << state);
    seen & (1 << J) != 0 && seen & (1 << K) != 0
}

/// Sets the controller up as the HAL's `Driver::new` and `Driver::start` do; the endpoints'
/// settings are in memory that no reset changes.
fn attach() {
    let usb = pac::USB;
    usb.usb_muxing().write(|w| {
        w.set_to_phy(true);
        w.set_softcon(true);
    });
    usb.usb_pwr().write(|w| {
        w.set_vbus_detect(true);
        w.set_vbus_detect_override_en(true);
    });
    usb.main_ctrl().write(|w| w.set_controller_en(true));
    usb.inte().write(|w| {
        w.set_bus_reset(true);
        w.set_buff_status(true);
        w.set_dev_resume_from_host(true);
        w.set_dev_suspend(true);
        w.set_setup_req(true);
    });
    frames::look_at_next();
    usb.int_ep_ctrl().write(|w| w.set_int_ep_active(0xfffe));
    usb.sie_ctrl().write(|w| {
        w.set_ep0_int_1buf(true);
        w.set_pullup_en(true);
    });
}
