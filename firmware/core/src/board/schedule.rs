//! What is due, and when.

use plumb_protocol::units::Micros;

/// Longest time between two telemetries once a host was greeted, µs.
pub(super) const TELEMETRY_US: u64 = 100_000;

/// Ticks from the last report of an open emergency input until it counts as closed: the tick that
/// the report precedes, and one that no report precedes.
pub(super) const EMERGENCY_TICKS: u8 = 2;

/// Set-up of motor drivers over their UART, which the chip carries out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DriverSetup {
    /// The drivers are set up, or have no UART.
    Done,
    /// The drivers are set up again after a fault of one. They stay on; the motors wait.
    Again,
    /// The drivers are set up after a configuration. They are off until then.
    First,
}

/// What the coming tick has to do besides its pulses.
#[derive(Debug)]
pub(super) struct Schedule {
    /// Whether an event is to be handled in the coming tick.
    pub(super) dirty: bool,
    /// Whether an event was handled in this tick.
    pub(super) had_event: bool,
    /// Ticks until one with an expired deadline.
    pub(super) idle_ticks: u32,
    /// Whether the second half of the coming tick has a position's progress or the end of a stop to
    /// check.
    pub(super) check_due: bool,
    /// Whether telemetry is to be sent after this tick.
    pub(super) telemetry_due: bool,
    /// Ticks to be planned until the emergency input counts as closed.
    pub(super) emergency_ticks: u8,
    /// Whether the drivers are on.
    pub(super) drivers_on: bool,
    /// Set-up of the drivers over their UART.
    pub(super) driver_setup: DriverSetup,
    /// When drivers that were switched on will take pulses; `None` once they do.
    pub(super) drivers_ready: Option<Micros>,
}

impl Schedule {
    /// Creates the schedule of a board that has just started.
    pub(super) fn new() -> Self {
        Self {
            dirty: true,
            had_event: false,
            idle_ticks: 0,
            check_due: false,
            telemetry_due: false,
            emergency_ticks: 0,
            drivers_on: false,
            driver_setup: DriverSetup::Done,
            drivers_ready: None,
        }
    }

    /// Returns whether the drivers are set up and take pulses.
    #[inline(always)]
    pub(super) fn can_move(&self) -> bool {
        self.drivers_ready.is_none() && self.driver_setup == DriverSetup::Done
    }
}
