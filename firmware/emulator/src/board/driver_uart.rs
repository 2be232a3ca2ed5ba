//! The TMC2209 of the motors on the board's UART, and the monitor that the firmware runs for them.

use std::mem;
use std::ops::Range;

use plumb_core::Board;
use plumb_core::tmc2209::{EXCHANGE_US, Event, Monitor, Settings};
use plumb_protocol::PerMotor;
use plumb_protocol::units::Micros;

use crate::tmc2209::{Driver, Trouble, Wire};

/// A trouble of a motor's driver on a UART, for a rehearsal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriverTrouble {
    /// Index of the motor, 0 to 2.
    pub motor: u8,
    /// What troubles the driver.
    pub trouble: Trouble,
    /// When, on the board's clock. [`Trouble::Reset`] comes once at the start of it, and once for
    /// drivers that a configuration within it names.
    pub time: Range<Micros>,
}

impl DriverTrouble {
    /// Returns what troubles the driver of `motor` at `now`.
    fn at(&self, motor: u8, now: Micros) -> Option<Trouble> {
        (self.motor == motor && self.time.contains(&now)).then_some(self.trouble)
    }
}

/// Drivers on a UART, at the addresses that a wiring names.
pub(super) struct DriverUart {
    monitor: Monitor,
    wire: Wire,
    /// What has arrived by the end of the exchange under way.
    received: Vec<u8>,
    /// End of the exchange under way, or when the monitor of a failed driver is looked after.
    due: Micros,
    /// Whether drivers that failed are to be set up again.
    is_set_up_wanted: bool,
}

impl DriverUart {
    /// Returns the drivers of the board's configuration, which get their first request now; `None`
    /// of drivers without a UART.
    pub(super) fn of(board: &Board, now: Micros) -> Option<Self> {
        let driver = board.wiring()?.drivers.tmc2209()?;
        let settings = Settings::new(driver, board.config()?.microsteps)?;
        let drivers = driver.addresses.iter().zip(0..);
        let drivers = drivers.map(|(address, motor)| Driver::new(*address, motor)).collect();
        let mut uart = Self {
            monitor: Monitor::new(settings),
            wire: Wire { drivers, directions: PerMotor::default() },
            received: Vec::new(),
            due: now,
            is_set_up_wanted: false,
        };
        uart.begin_exchange();
        Some(uart)
    }

    /// Requests that drivers that failed are set up again.
    pub(super) fn request_set_up(&mut self) {
        self.is_set_up_wanted = true;
    }

    /// Returns which drivers give their motors current while ENABLE is on. A motor that the rig has
    /// not drops no ball.
    pub(super) fn currents(&self) -> PerMotor<bool> {
        std::array::from_fn(|motor| self.wire.drivers.get(motor).is_none_or(Driver::has_current))
    }

    /// Runs to `now`, with motors that turn at these rates. Call this in every tick, which is
    /// shorter than an exchange. Returns what the board is to be told.
    pub(super) fn advance(
        &mut self,
        now: Micros,
        rates: PerMotor<i32>,
        trouble: Option<&DriverTrouble>,
    ) -> Option<Event> {
        for (driver, rate) in self.wire.drivers.iter_mut().zip(rates) {
            driver.is_standing = rate == 0;
            driver.set_trouble(trouble.and_then(|trouble| trouble.at(driver.motor, now)));
        }
        if now < self.due {
            return None;
        }
        if self.monitor.has_failed() && mem::take(&mut self.is_set_up_wanted) {
            self.monitor.set_up_again();
            self.begin_exchange();
            return None;
        }
        let event = self.monitor.take(&self.received);
        if matches!(event, Some(Event::Failed(_))) {
            // The requests of before the failure.
            self.is_set_up_wanted = false;
        }
        self.begin_exchange();
        event
    }

    /// Sends the next request, if there is one.
    fn begin_exchange(&mut self) {
        self.due.0 += u64::from(EXCHANGE_US);
        if let Some(exchange) = self.monitor.exchange() {
            self.wire.directions = exchange.directions.unwrap_or_default();
            self.received = self.wire.send(exchange.bytes());
        }
    }
}

#[cfg(test)]
mod tests;
