//! The frames of USB: when the last one began, and when a transfer to the host may be offered.
//!
//! Erratum E15 of the RP2040: the controller hangs where a bus error damages the host's
//! acknowledgement of data. A host that fetches data late in a frame, up to the beginning of the
//! next one, can cause that. As TinyUSB does (rp2040_usb.c: `e15_is_critical_frame_period`), data
//! is not offered during the last part of a frame. What is left of the erratum is the
//! [supervisor's](super::supervisor).
//!
//! An interrupt for each frame would take the processor 0.3 % of its time. Frames come every
//! millisecond, so that the beginning of one in each period of the supervisor tells all others.

use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::Poll;

use embassy_rp::interrupt::typelevel::{Handler, USBCTRL_IRQ};
use embassy_rp::pac;
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Duration, with_timeout};

/// Endpoint of the data to the host: embassy-usb gives the class its endpoints in turn, and the
/// first is that of the notifications. A test in the emulated chip fails where it is another one.
pub(super) const DATA_IN: usize = 2;

/// Duration of a frame, µs.
const FRAME_US: u32 = 1000;
/// Time after the beginning of a frame from which on no data is offered, µs. TinyUSB keeps the last
/// 200 µs free; 150 more are for what interrupts the task between its look and the offer.
const LATEST_OFFER_US: u32 = FRAME_US - 350;
/// Time for which the beginning of a frame tells those of later ones, µs: two periods of the
/// supervisor. Host and chip differ by 25 µs at most meanwhile (500 and 100 ppm).
const FRAME_TIMEOUT_US: u32 = 40 * FRAME_US;

/// Beginning of the last frame that interrupted, on the timer, µs; wraps.
static LAST_FRAME: AtomicU32 = AtomicU32::new(0);
/// Transfers of data to the host that have ended; wraps.
static ENDED: AtomicU32 = AtomicU32::new(0);
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
        if reasons.buff_status() && usb.buff_status().read().ep_in(DATA_IN) {
            ENDED.store(ended().wrapping_add(1), Ordering::Relaxed);
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
pub(super) fn is_offered() -> bool {
    pac::USB_DPRAM.ep_in_buffer_control(DATA_IN).read().available(0)
}

/// Returns how many transfers of data to the host have ended; wraps.
pub(super) fn ended() -> u32 {
    ENDED.load(Ordering::Relaxed)
}

/// Returns whether the host sends frames.
pub(super) fn come() -> bool {
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

fn timer() -> u32 {
    pac::TIMER.timerawl().read()
}
