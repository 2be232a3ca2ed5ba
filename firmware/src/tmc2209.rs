//! TMC2209 drivers on UART1: a task carries out the exchanges of [`plumb_core::tmc2209`].
//!
//! Each exchange fits the UART's queues of 32 bytes, so that nothing waits for a byte and no
//! interrupt is used: the task gives the request, sleeps for [`EXCHANGE_US`], and takes what has
//! arrived, its own echo first. The stepping interrupt, above it, gets the events.

pub(crate) mod event;

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_rp::pac;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer};
use heapless::Vec;
use plumb_core::tmc2209::{BAUD, EXCHANGE_US, MAX_RECEIVED, Monitor, Settings};
use plumb_protocol::dimension::{MotorList, PerMotor};
use plumb_protocol::wiring::{Pin, Wiring};

use crate::pins;
use event::wiring_in_force;

/// Time after which the task looks whether a driver that failed is to be set up again.
const PAUSE: Duration = Duration::from_millis(5);

/// Drivers of a wiring.
struct Drivers {
    /// Number of the wiring.
    number: u32,
    settings: Settings,
    /// DIR of each motor.
    directions: MotorList<Pin>,
}

/// Drivers of the newest wiring with some.
static DRIVERS: Signal<CriticalSectionRawMutex, Drivers> = Signal::new();
/// Whether drivers that failed are to be set up again.
static SET_UP: AtomicBool = AtomicBool::new(false);

/// Begins to set up and watch the drivers of a new wiring, if it has such drivers, and ends that
/// of the last one. Called by the stepping interrupt, with the drivers off; never waits.
#[cold]
pub(crate) fn begin(wiring: &Wiring, microsteps: u8) {
    let number = event::begin_wiring();
    let settings = wiring.drivers.tmc2209().and_then(|driver| Settings::new(driver, microsteps));
    if let Some(settings) = settings {
        let directions = wiring.pins.motors.map(|motor| motor.direction);
        DRIVERS.signal(Drivers { number, settings, directions });
    }
}

/// Requests that drivers that failed are set up again, or drops the request. Called by the stepping
/// interrupt; never waits.
pub(crate) fn request_set_up(is_wanted: bool) {
    SET_UP.store(is_wanted, Ordering::Relaxed);
}

/// Sets up and watches the drivers of each wiring that has some.
#[embassy_executor::task]
pub(crate) async fn watch_drivers() {
    loop {
        let drivers = DRIVERS.wait().await;
        start_uart();
        watch(&drivers).await;
    }
}

/// Watches the drivers of a wiring until the next one.
async fn watch(drivers: &Drivers) {
    let mut monitor = Monitor::new(drivers.settings);
    let mut directions = None;
    while wiring_in_force() == drivers.number {
        let exchange = monitor.exchange();
        let wanted = exchange.and_then(|exchange| exchange.directions);
        if wanted != directions {
            directions = wanted;
            set_directions(drivers, wanted);
        }
        let Some(exchange) = exchange else {
            // A tick later the stepping interrupt has dropped the requests before the failure.
            Timer::after(PAUSE).await;
            if SET_UP.load(Ordering::Relaxed) {
                SET_UP.store(false, Ordering::Relaxed);
                monitor.set_up_again();
            }
            continue;
        };
        receive();
        send(exchange.bytes());
        Timer::after_micros(EXCHANGE_US.into()).await;
        if let Some(news) = monitor.take(&receive()) {
            event::report(drivers.number, news);
        }
    }
}

/// Gives the pins DIR these levels, or back to the step generator, unless another wiring is in
/// force. The stepping interrupt waits meanwhile, at standstill.
#[cold]
fn set_directions(drivers: &Drivers, levels: Option<PerMotor<bool>>) {
    critical_section::with(|_| {
        if wiring_in_force() != drivers.number {
            return;
        }
        for (motor, pin) in drivers.directions.iter().enumerate() {
            let control =
                levels.map_or(pins::generated(*pin), |levels| pins::constant(levels[motor]));
            pins::set(pin.number, control);
        }
    });
}

/// Sets up the UART: 8 bits, no parity (RP2040 data sheet, section 4.2.7).
#[cold]
fn start_uart() {
    pac::RESETS.reset().modify(|w| w.set_uart1(true));
    pac::RESETS.reset().modify(|w| w.set_uart1(false));
    while !pac::RESETS.reset_done().read().uart1() {}
    // The divider in 1/64, rounded.
    let divider = (8 * embassy_rp::clocks::clk_peri_freq() / BAUD).div_ceil(2);
    pac::UART1.uartibrd().write(|w| w.set_baud_divint((divider >> 6) as u16));
    pac::UART1.uartfbrd().write(|w| w.set_baud_divfrac((divider & 63) as u8));
    pac::UART1.uartlcr_h().write(|w| {
        w.set_wlen(3);
        w.set_fen(true);
    });
    pac::UART1.uartcr().write(|w| {
        w.set_uarten(true);
        w.set_txe(true);
        w.set_rxe(true);
    });
}

/// Gives the UART a datagram: its queue is empty.
#[cold]
fn send(bytes: &[u8]) {
    for &byte in bytes {
        pac::UART1.uartdr().write(|w| w.set_data(byte));
    }
}

/// Takes what has arrived; of more than the longest answer, one byte too many.
#[cold]
fn receive() -> Vec<u8, { MAX_RECEIVED + 1 }> {
    let mut received = Vec::new();
    while !pac::UART1.uartfr().read().rxfe() {
        let byte = pac::UART1.uartdr().read().data();
        let _ = received.push(byte);
    }
    received
}
