//! What the firmware does about erratum E15 of the RP2040: the USB controller hangs where a bus
//! error damages the host's acknowledgement of data. A host that fetches data late in a frame, up
//! to the beginning of the next one, can cause that.
//!
//! As TinyUSB does (rp2040_usb.c: `e15_is_critical_frame_period`), data is not offered during the
//! last part of a frame. An interrupt for each frame would take the processor 0.3 % of its time.
//! Frames come every millisecond, so that the beginning of one in each period of the supervisor
//! tells all others.
//!
//! The [supervisor](Supervisor) resets a controller that hangs all the same. Such a controller
//! takes part in no transfer any more, and no reset of the bus ends that (hathach/tinyusb, pull
//! request 1779; embassy-rs/embassy, issue 2880). So data that is offered stays offered, although
//! the bus is in use: packets are on the line and no frames come, or the host goes on to send data.
//! A host that is paused, whose frames come, does neither. A reset takes the board off the bus for
//! a moment, and the host enumerates it anew. It comes at rest only: while motors turn, the host's
//! silence has ended a run long before.

use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::Poll;

use embassy_rp::interrupt::typelevel::{Handler, USBCTRL_IRQ};
use embassy_rp::pac;
use embassy_rp::pac::usb_dpram::regs::EpBufferControl;
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Duration, Instant, Timer, with_timeout};

use crate::chip::timer;
use crate::diagnostics;

/// Endpoint of the data to the host: embassy-usb gives the class its endpoints in turn, and the
/// first is that of the notifications. A test in the emulated chip fails where it is another one.
const DATA_IN: usize = 2;
/// Endpoint of the data from the host.
const DATA_OUT: usize = 1;

/// Duration of a frame, µs.
const FRAME_US: u32 = 1000;
/// Time after the beginning of a frame from which on no data is offered, µs. TinyUSB keeps the last
/// 200 µs free; 450 more are for a tick of up to 190 µs that delays the interrupt of the frame, for
/// another between the task's look and the offer, and for the peripherals' interrupts.
const LATEST_OFFER_US: u32 = FRAME_US - 650;
/// Time for which the beginning of a frame tells those of later ones, µs: two periods of the
/// supervisor. Host and chip differ by 25 µs at most meanwhile (500 and 100 ppm).
const FRAME_TIMEOUT_US: u32 = 40 * FRAME_US;

/// Beginning of the last frame that interrupted, on the timer, µs; wraps.
static LAST_FRAME: AtomicU32 = AtomicU32::new(0);
/// Transfers of data to the host that have ended; wraps.
static ENDED: AtomicU32 = AtomicU32::new(0);
/// Packets of data from the host; wraps.
static HEARD: AtomicU32 = AtomicU32::new(0);
/// The task that waits to offer data; woken by every interrupt of USB while it waits.
static OFFER: AtomicWaker = AtomicWaker::new();
/// Whether it waits: the waker stays where it is, and each wake-up costs the processor 600 clocks.
static IS_AWAITED: AtomicBool = AtomicBool::new(false);

/// Handler of the interrupt of USB, before that of the HAL.
pub(crate) struct FrameHandler;

impl Handler<USBCTRL_IRQ> for FrameHandler {
    unsafe fn on_interrupt() {
        let usb = pac::USB;
        let reasons = usb.ints().read();
        if reasons.dev_sof() {
            // Reading the frame's number ends the interrupt.
            usb.sof_rd().read();
            LAST_FRAME.store(timer(), Ordering::Relaxed);
            if !IS_AWAITED.load(Ordering::Relaxed) {
                usb.inte().modify(|w| w.set_dev_sof(false));
            }
        }
        if reasons.buff_status() {
            let buffers = usb.buff_status().read();
            for (is_done, count) in
                [(buffers.ep_in(DATA_IN), &ENDED), (buffers.ep_out(DATA_OUT), &HEARD)]
            {
                if is_done {
                    count.store(count.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
                }
            }
        }
        if IS_AWAITED.load(Ordering::Relaxed) {
            OFFER.wake();
        }
    }
}

/// Lets the next frame interrupt, and all until then that a task waits for.
pub(super) fn look_at_next() {
    critical_section::with(|_| {
        // The flag of an earlier frame would interrupt at once.
        pac::USB.sof_rd().read();
        pac::USB.inte().modify(|w| w.set_dev_sof(true));
    });
}

/// Waits until data may be offered to the host: the last transfer has ended, and the frame is not
/// near its end. Where no next frame comes, nothing is to be feared of its beginning.
pub(super) async fn until_offer() {
    until(|| !is_offered()).await;
    if is_early() {
        return;
    }
    look_at_next();
    let _ = with_timeout(Duration::from_micros(FRAME_US.into()), until(is_early)).await;
}

/// Waits for an interrupt of USB that finds a condition true.
async fn until(is_true: impl Fn() -> bool) {
    poll_fn(|context| {
        OFFER.register(context.waker());
        IS_AWAITED.store(true, Ordering::Relaxed);
        if is_true() {
            IS_AWAITED.store(false, Ordering::Relaxed);
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    })
    .await;
}

/// Returns whether data is offered that the host has not taken.
fn is_offered() -> bool {
    pac::USB_DPRAM.ep_in_buffer_control(DATA_IN).read().available(0)
}

/// Returns whether the host sends frames.
fn frames_come() -> bool {
    since_known_frame() < FRAME_TIMEOUT_US
}

/// Returns whether the frame is not near its end; also where none come.
fn is_early() -> bool {
    let since = since_known_frame();
    since >= FRAME_TIMEOUT_US || since % FRAME_US < LATEST_OFFER_US
}

/// Returns the time since the beginning of the last frame that interrupted, µs.
fn since_known_frame() -> u32 {
    timer().wrapping_sub(LAST_FRAME.load(Ordering::Relaxed))
}

/// Whether a motor turns; at most 3.2 ms old.
static MOVING: AtomicBool = AtomicBool::new(false);

/// Notes whether a motor turns. Called by the stepping interrupt.
#[inline(always)]
pub(crate) fn set_moving(moving: bool) {
    MOVING.store(moving, Ordering::Relaxed);
}

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
    pending: Option<Pending>,
}

/// A transfer that does not end.
struct Pending {
    /// Its number.
    transfer: u32,
    /// Packets from the host before it.
    heard: u32,
    /// When it was seen first.
    since: Instant,
}

impl Supervisor {
    /// Looks at the controller, once in a [`PERIOD`]. Returns whether it hangs. `is_open`: a
    /// program has opened the port, so that the host takes data.
    pub(super) fn hangs(&mut self, is_open: bool) -> bool {
        look_at_next();
        let is_configured = pac::USB_DPRAM.ep_in_control(DATA_IN - 1).read().enable();
        if !(is_open && is_configured && is_offered()) {
            self.pending = None;
            return false;
        }
        let [transfer, heard] = [&ENDED, &HEARD].map(|count| count.load(Ordering::Relaxed));
        let now = Instant::now();
        match self.pending.as_ref().filter(|pending| pending.transfer == transfer) {
            Some(pending) if now - pending.since < LIMIT => false,
            Some(pending) if frames_come() => pending.heard != heard,
            Some(_) => is_line_in_use(),
            None => {
                self.pending = Some(Pending { transfer, heard, since: now });
                false
            }
        }
    }

    /// Resets the controller if the motors are at rest. Returns whether it did.
    pub(super) async fn reset(&mut self) -> bool {
        if MOVING.load(Ordering::Relaxed) {
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
    look_at_next();
    usb.int_ep_ctrl().write(|w| w.set_int_ep_active(0xfffe));
    usb.sie_ctrl().write(|w| {
        w.set_ep0_int_1buf(true);
        w.set_pullup_en(true);
    });
}
