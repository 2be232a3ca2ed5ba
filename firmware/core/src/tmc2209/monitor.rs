//! Set-up of the drivers, and their watch.

use plumb_protocol::dimension::{MOTORS, PerMotor};
use plumb_protocol::message::{DriverFault, DriverReading};
use plumb_protocol::wiring::Chopper;

use super::datagram::{Exchange, NoAnswer};
use super::register;
use super::settings::Settings;
use crate::vector::per_motor;

/// Attempts for an exchange, and for the set-up of a driver.
const ATTEMPTS: u8 = 3;
/// Addresses on a wire.
const ADDRESSES: u8 = 4;
/// NODECONF: a reply comes after three times 8 bits. On a wire with several drivers it must be 2 at
/// least, or the others may take a reply for a damaged request (section 5.1).
const SEND_DELAY: u32 = 2 << 8;
/// Version of the chip in IOIN.
const VERSION: u32 = 0x21;
/// Rounds of the poll between two reports: about 0.1 s.
const ROUNDS_PER_REPORT: u8 = 10;
/// Item of a set-up that compares IFCNT, and the next and last one, which reads the version.
const COUNT_ITEM: u8 = Settings::WRITES + 1;
const VERSION_ITEM: u8 = COUNT_ITEM + 1;
/// The motor number of no motor.
const NONE: u8 = MOTORS as u8;

/// Bits of GSTAT (section 5.1).
mod gstat {
    pub(super) const RESET: u32 = 1;
    pub(super) const SHUT_DOWN: u32 = 1 << 1;
    pub(super) const UNDERVOLTAGE: u32 = 1 << 2;
}

/// Bits of DRV_STATUS (section 5.5.3).
mod drv_status {
    pub(super) const PREWARNING: u32 = 1;
    pub(super) const OVERTEMPERATURE: u32 = 1 << 1;
    pub(super) const SHORT: u32 = 0b1111 << 2;
    pub(super) const OPEN_LOAD: u32 = 0b11 << 6;
    pub(super) const STANDSTILL: u32 = 1 << 31;
}

/// What the board learns from an exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// All drivers are set up and at their addresses.
    Ready,
    /// A driver failed. Nothing is asked until [`Monitor::set_up_again`].
    Failed(DriverFault),
    /// Readings of the drivers of motors A, B and C.
    Readings(PerMotor<DriverReading>),
}

/// Place in the sequence of exchanges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Sets the delay of replies at each address, also those of drivers without a motor here.
    Delay { address: u8 },
    /// Sets up a motor's driver: IFCNT, the writes, IFCNT, the version.
    SetUp { motor: u8, item: u8 },
    /// Checks that DIR of a driver follows: with DIR of motor `high` high, or of none.
    Directions { high: u8, motor: u8 },
    /// Watches a motor's driver: GSTAT, then DRV_STATUS; at last SG_RESULT of one.
    Poll { motor: u8, has_state: bool },
    /// A driver failed.
    Failed,
}

/// Monitor of the drivers. The [module's front page](super) has its sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Monitor {
    settings: Settings,
    phase: Phase,
    /// Whether the drivers have been off since the configuration: DIR may be set by hand.
    are_off: bool,
    /// Failed attempts of the present exchange, and of the present set-up.
    attempts: [u8; 2],
    /// IFCNT before the writes.
    count: u8,
    /// GSTAT of the driver that is asked for its DRV_STATUS.
    state: u32,
    /// Open coils of each driver in its last poll while its motor turned.
    open: PerMotor<u32>,
    readings: PerMotor<DriverReading>,
    /// Rounds of the poll since the last report.
    rounds: u8,
    /// Whether a warning has come or gone since the last report.
    has_changed: bool,
    /// Motor whose SG_RESULT is read next.
    loaded: u8,
}

impl Monitor {
    /// Creates the monitor of drivers that are off.
    #[cold]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            phase: Phase::Delay { address: 0 },
            are_off: true,
            attempts: [0; 2],
            count: 0,
            state: 0,
            open: [0; MOTORS],
            readings: [DriverReading::default(); MOTORS],
            rounds: 0,
            has_changed: false,
            loaded: 0,
        }
    }

    /// Sets up the drivers again, after a failure.
    #[cold]
    pub fn set_up_again(&mut self) {
        let are_off = self.are_off;
        *self = Self { are_off, ..Self::new(self.settings) };
    }

    /// Returns whether a driver failed, so that there is nothing to send.
    #[cold]
    pub fn has_failed(&self) -> bool {
        self.phase == Phase::Failed
    }

    /// Returns what is to be sent next; `None` after a failure.
    #[cold]
    pub fn exchange(&self) -> Option<Exchange> {
        let read = |motor: u8, register| Exchange::read(self.address(motor), register);
        Some(match self.phase {
            Phase::Delay { address } => Exchange::write(address, register::NODECONF, SEND_DELAY),
            Phase::SetUp { motor, item: 0 | COUNT_ITEM } => read(motor, register::IFCNT),
            Phase::SetUp { motor, item: VERSION_ITEM } => read(motor, register::IOIN),
            Phase::SetUp { motor, item } => {
                let (register, value) = self.settings.write(item - 1);
                Exchange::write(self.address(motor), register, value)
            }
            Phase::Directions { high, motor } => Exchange {
                directions: Some(per_motor(|motor| motor == usize::from(high))),
                ..read(motor, register::IOIN)
            },
            Phase::Poll { motor: NONE, .. } => read(self.loaded, register::SG_RESULT),
            Phase::Poll { motor, has_state: false } => read(motor, register::GSTAT),
            Phase::Poll { motor, has_state: true } => read(motor, register::DRV_STATUS),
            Phase::Failed => return None,
        })
    }

    /// Takes in the bytes that came over the wire in the last [`exchange`](Self::exchange).
    #[cold]
    pub fn take(&mut self, received: &[u8]) -> Option<Event> {
        match self.exchange()?.answer(received) {
            Ok(value) => {
                self.attempts[0] = 0;
                self.advance(value)
            }
            Err(reason) => {
                self.attempts[0] += 1;
                (self.attempts[0] == ATTEMPTS).then(|| self.fail(self.unanswered(reason)))
            }
        }
    }

    /// Returns the address of a motor's driver.
    fn address(&self, motor: u8) -> u8 {
        self.settings.addresses[usize::from(motor)]
    }

    /// Ends the sequence.
    #[cold]
    fn fail(&mut self, fault: DriverFault) -> Event {
        self.phase = Phase::Failed;
        Event::Failed(fault)
    }

    /// Returns the fault of a driver without an answer. Two drivers with one address answer at
    /// once. Their answers damage each other where they differ: in IOIN, where their pins do.
    #[cold]
    fn unanswered(&self, reason: NoAnswer) -> DriverFault {
        let motor = match self.phase {
            Phase::Poll { motor: NONE, .. } => self.loaded,
            Phase::SetUp { motor, .. }
            | Phase::Directions { motor, .. }
            | Phase::Poll { motor, .. } => motor,
            Phase::Delay { .. } | Phase::Failed => 0,
        };
        match (reason, self.phase) {
            (NoAnswer::Silent, _) => DriverFault::Silent(motor),
            (_, Phase::Directions { .. } | Phase::SetUp { item: VERSION_ITEM, .. }) => {
                DriverFault::Address(motor)
            }
            _ => DriverFault::BadReplies(motor),
        }
    }

    /// Goes on after an answer.
    #[cold]
    fn advance(&mut self, value: u32) -> Option<Event> {
        match self.phase {
            Phase::Delay { address } => {
                self.phase = match address + 1 {
                    ADDRESSES => Phase::SetUp { motor: 0, item: 0 },
                    address => Phase::Delay { address },
                };
                None
            }
            Phase::SetUp { motor, item } => self.set_up(motor, item, value),
            Phase::Directions { high, motor } => self.check_direction(high, motor, value),
            Phase::Poll { motor: NONE, .. } => self.end_round(value),
            Phase::Poll { motor, has_state: false } => {
                self.state = value;
                self.phase = Phase::Poll { motor, has_state: true };
                None
            }
            Phase::Poll { motor, has_state: true } => self.watch(motor, value),
            Phase::Failed => None,
        }
    }

    #[cold]
    fn set_up(&mut self, motor: u8, item: u8, value: u32) -> Option<Event> {
        self.phase = Phase::SetUp { motor, item: item + 1 };
        match item {
            0 => self.count = value as u8,
            COUNT_ITEM if value as u8 == self.count.wrapping_add(Settings::WRITES) => {
                self.attempts[1] = 0;
            }
            COUNT_ITEM => {
                self.attempts[1] += 1;
                if self.attempts[1] == ATTEMPTS {
                    return Some(self.fail(DriverFault::BadReplies(motor)));
                }
                self.phase = Phase::SetUp { motor, item: 0 };
            }
            item if item < COUNT_ITEM => {}
            _ if value >> 24 != VERSION => return Some(self.fail(DriverFault::Version(motor))),
            _ if motor + 1 < NONE => self.phase = Phase::SetUp { motor: motor + 1, item: 0 },
            _ if self.are_off => self.phase = Phase::Directions { high: NONE, motor: 0 },
            _ => return Some(self.begin_poll()),
        }
        None
    }

    /// Checks DIR of a driver: first with all of them low, then with each motor's high.
    #[cold]
    fn check_direction(&mut self, high: u8, motor: u8, value: u32) -> Option<Event> {
        if (value >> 9 & 1 == 1) != (motor == high) {
            return Some(self.fail(DriverFault::Address(motor)));
        }
        self.phase = match (high, motor + 1) {
            (NONE, NONE) => Phase::Directions { high: 0, motor: 0 },
            (high, NONE) if high + 1 == NONE => return Some(self.begin_poll()),
            (high, NONE) => Phase::Directions { high: high + 1, motor: 0 },
            (high, motor) => Phase::Directions { high, motor },
        };
        None
    }

    #[cold]
    fn begin_poll(&mut self) -> Event {
        self.are_off = false;
        self.phase = Phase::Poll { motor: 0, has_state: false };
        Event::Ready
    }

    /// Judges a driver by GSTAT and DRV_STATUS, `flags`. GSTAT keeps a shut-down that is over: that
    /// was for the temperature, since a short circuit keeps its flag.
    #[cold]
    fn watch(&mut self, motor: u8, flags: u32) -> Option<Event> {
        let has = |bits| flags & bits != 0;
        let was = |bits| self.state & bits != 0;
        let fault = if was(gstat::RESET) {
            Some(DriverFault::Reset(motor))
        } else if was(gstat::UNDERVOLTAGE) {
            Some(DriverFault::Undervoltage(motor))
        } else if has(drv_status::SHORT) {
            Some(DriverFault::Short(motor))
        } else if has(drv_status::OVERTEMPERATURE) || was(gstat::SHUT_DOWN) {
            Some(DriverFault::Overtemperature(motor))
        } else {
            None
        };
        if let Some(fault) = fault {
            return Some(self.fail(fault));
        }
        let turns = !has(drv_status::STANDSTILL);
        let open = if turns { flags & drv_status::OPEN_LOAD } else { 0 };
        let index = usize::from(motor);
        let reading = DriverReading {
            is_hot: has(drv_status::PREWARNING),
            has_open_load: open & self.open[index] != 0,
            ..self.readings[index]
        };
        self.open[index] = open;
        self.has_changed |= reading != self.readings[index];
        self.readings[index] = reading;
        self.phase = Phase::Poll { motor: motor + 1, has_state: false };
        if motor + 1 == NONE && self.settings.chopper != Chopper::StealthChop {
            return self.end_round(0);
        }
        None
    }

    /// Takes in SG_RESULT of a driver, and ends the round.
    #[cold]
    fn end_round(&mut self, result: u32) -> Option<Event> {
        if self.settings.chopper == Chopper::StealthChop {
            self.readings[usize::from(self.loaded)].stall_guard = Some(result as u16 & 0x3ff);
            self.loaded = (self.loaded + 1) % NONE;
        }
        self.phase = Phase::Poll { motor: 0, has_state: false };
        self.rounds += 1;
        if self.rounds < ROUNDS_PER_REPORT && !self.has_changed {
            return None;
        }
        (self.rounds, self.has_changed) = (0, false);
        Some(Event::Readings(self.readings))
    }
}

#[cfg(test)]
mod tests;
