//! Set-up of the drivers, and their watch.

use plumb_protocol::dimension::{MOTORS, PerMotor};
use plumb_protocol::message::{DriverFault, DriverReading};
use plumb_protocol::wiring::Chopper;

use super::datagram::{Exchange, NoAnswer};
use super::register;
use super::settings::{SEND_DELAY, Settings};
use crate::vector::per_motor;

/// Attempts for an exchange, and for the set-up of a driver.
const ATTEMPTS: u8 = 3;
/// Exchanges without an answer of a driver's poll after which the driver counts as lost: 0.3 s.
const MAX_UNANSWERED: u8 = 200;
/// Addresses on a wire.
const ADDRESSES: u8 = 4;
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
    pub(super) const ALL: u32 = 0b111;
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
    /// Checks after a failure whether a motor's driver has kept its settings: GSTAT, then IFCNT.
    Check { motor: u8, has_state: bool },
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
    /// Drivers that are to be set up, a bit each.
    pending: u8,
    /// IFCNT of each driver: before the writes, and once it is set up.
    counts: PerMotor<u8>,
    /// Exchanges since each driver's last answered poll; saturating.
    unanswered: PerMotor<u8>,
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
            pending: (1 << settings.addresses.len()) - 1,
            counts: [0; MOTORS],
            unanswered: [0; MOTORS],
            state: 0,
            open: [0; MOTORS],
            readings: [DriverReading::default(); MOTORS],
            rounds: 0,
            has_changed: false,
            loaded: 0,
        }
    }

    /// Sets up the drivers again, after a failure. Once they have been on, a driver that has kept
    /// its settings gets no write: its motor keeps its current.
    #[cold]
    pub fn set_up_again(&mut self) {
        if self.are_off {
            *self = Self::new(self.settings);
            return;
        }
        self.attempts = [0; 2];
        self.phase = Phase::Check { motor: 0, has_state: false };
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
            Phase::Check { motor, has_state: true } => read(motor, register::IFCNT),
            Phase::Poll { motor: NONE, .. } => read(self.loaded, register::SG_RESULT),
            Phase::Check { motor, has_state: false } | Phase::Poll { motor, has_state: false } => {
                read(motor, register::GSTAT)
            }
            Phase::Poll { motor, has_state: true } => read(motor, register::DRV_STATUS),
            Phase::Failed => return None,
        })
    }

    /// Takes in the bytes that came over the wire in the last [`exchange`](Self::exchange).
    #[cold]
    pub fn take(&mut self, received: &[u8]) -> Option<Event> {
        let answer = self.exchange()?.answer(received);
        if matches!(self.phase, Phase::Poll { .. }) {
            self.unanswered = self.unanswered.map(|exchanges| exchanges.saturating_add(1));
        }
        match answer {
            Ok(value) => {
                self.attempts[0] = 0;
                self.advance(value)
            }
            Err(reason) => {
                self.attempts[0] += 1;
                (self.attempts[0] >= ATTEMPTS).then(|| self.give_up(reason)).flatten()
            }
        }
    }

    /// Goes on after the last attempt of an exchange: in the poll with the next driver, unless this
    /// one is lost.
    #[cold]
    fn give_up(&mut self, reason: NoAnswer) -> Option<Event> {
        self.attempts[0] = 0;
        match self.phase {
            Phase::Poll { motor: NONE, .. } => self.end_round(None),
            Phase::Poll { motor, .. } if self.unanswered[usize::from(motor)] < MAX_UNANSWERED => {
                let lost =
                    DriverReading { has_lost_replies: true, ..self.readings[usize::from(motor)] };
                self.note(motor, lost)
            }
            _ => Some(self.fail(self.no_answer(reason))),
        }
    }

    /// Returns the address of a motor's driver.
    fn address(&self, motor: u8) -> u8 {
        self.settings.addresses[usize::from(motor)]
    }

    /// Returns the motor after this one, or [`NONE`].
    #[cold]
    fn next(&self, motor: u8) -> u8 {
        let next = motor + 1;
        if usize::from(next) < self.settings.addresses.len() { next } else { NONE }
    }

    /// Ends the sequence.
    #[cold]
    fn fail(&mut self, fault: DriverFault) -> Event {
        self.phase = Phase::Failed;
        Event::Failed(fault)
    }

    /// Ends the sequence for a driver that is to be set up.
    #[cold]
    fn fail_motor(&mut self, motor: u8, fault: DriverFault) -> Event {
        self.pending |= 1 << motor;
        self.fail(fault)
    }

    /// Returns the fault of a driver without an answer. Two drivers with one address answer at
    /// once. Their answers damage each other where they differ: in IOIN, where their pins do.
    #[cold]
    fn no_answer(&self, reason: NoAnswer) -> DriverFault {
        let motor = match self.phase {
            Phase::Poll { motor: NONE, .. } => self.loaded,
            Phase::SetUp { motor, .. }
            | Phase::Directions { motor, .. }
            | Phase::Check { motor, .. }
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
            Phase::Check { motor, has_state } => self.check_settings(motor, has_state, value),
            Phase::Poll { motor: NONE, .. } => self.end_round(Some(value)),
            Phase::Poll { motor, has_state: false } => {
                self.state = value;
                self.phase = Phase::Poll { motor, has_state: true };
                None
            }
            Phase::Poll { motor, has_state: true } => self.watch(motor, value),
            Phase::Failed => None,
        }
    }

    /// Notes whether a driver has lost its settings: it was reset, has a flag that a set-up ends,
    /// or has not counted the writes that it got.
    #[cold]
    fn check_settings(&mut self, motor: u8, has_state: bool, value: u32) -> Option<Event> {
        let is_lost = match has_state {
            false => value & gstat::ALL != 0,
            true => value as u8 != self.counts[usize::from(motor)],
        };
        self.pending |= u8::from(is_lost) << motor;
        self.phase = match (has_state, self.next(motor)) {
            (false, _) => Phase::Check { motor, has_state: true },
            (true, NONE) => return self.set_up_from(0),
            (true, motor) => Phase::Check { motor, has_state: false },
        };
        None
    }

    /// Sets up the next driver from this motor's on, and goes on after the last.
    #[cold]
    fn set_up_from(&mut self, motor: u8) -> Option<Event> {
        let skipped = (self.pending >> motor).trailing_zeros() as u8;
        self.phase = match motor.saturating_add(skipped) {
            motor if motor < NONE => Phase::SetUp { motor, item: 0 },
            _ if self.are_off => Phase::Directions { high: NONE, motor: 0 },
            _ => return Some(self.begin_poll()),
        };
        None
    }

    #[cold]
    fn set_up(&mut self, motor: u8, item: u8, value: u32) -> Option<Event> {
        let count = &mut self.counts[usize::from(motor)];
        self.phase = Phase::SetUp { motor, item: item + 1 };
        match item {
            0 => *count = value as u8,
            COUNT_ITEM if value as u8 == count.wrapping_add(Settings::WRITES) => {
                *count = value as u8;
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
            _ => {
                self.pending &= !(1 << motor);
                return self.set_up_from(motor + 1);
            }
        }
        None
    }

    /// Checks DIR of a driver: first with all of them low, then with each motor's high.
    #[cold]
    fn check_direction(&mut self, high: u8, motor: u8, value: u32) -> Option<Event> {
        if (value >> 9 & 1 == 1) != (motor == high) {
            return Some(self.fail(DriverFault::Address(motor)));
        }
        self.phase = match (high, self.next(motor)) {
            (NONE, NONE) => Phase::Directions { high: 0, motor: 0 },
            (high, NONE) if self.next(high) == NONE => return Some(self.begin_poll()),
            (high, NONE) => Phase::Directions { high: high + 1, motor: 0 },
            (high, motor) => Phase::Directions { high, motor },
        };
        None
    }

    #[cold]
    fn begin_poll(&mut self) -> Event {
        self.are_off = false;
        self.unanswered = [0; MOTORS];
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
            return Some(self.fail_motor(motor, fault));
        }
        let turns = !has(drv_status::STANDSTILL);
        let open = if turns { flags & drv_status::OPEN_LOAD } else { 0 };
        let index = usize::from(motor);
        let reading = DriverReading {
            is_hot: has(drv_status::PREWARNING),
            has_open_load: open & self.open[index] != 0,
            has_lost_replies: false,
            ..self.readings[index]
        };
        self.open[index] = open;
        self.unanswered[index] = 0;
        self.note(motor, reading)
    }

    /// Notes the reading of a motor's driver, and goes on with the next one.
    #[cold]
    fn note(&mut self, motor: u8, reading: DriverReading) -> Option<Event> {
        let index = usize::from(motor);
        self.has_changed |= reading != self.readings[index];
        self.readings[index] = reading;
        let motor = self.next(motor);
        self.phase = Phase::Poll { motor, has_state: false };
        if motor == NONE && self.settings.chopper != Chopper::StealthChop {
            return self.end_round(None);
        }
        None
    }

    /// Takes in SG_RESULT of a driver where it was read, and ends the round.
    #[cold]
    fn end_round(&mut self, result: Option<u32>) -> Option<Event> {
        if self.settings.chopper == Chopper::StealthChop {
            if let Some(result) = result {
                self.readings[usize::from(self.loaded)].stall_guard = Some(result as u16 & 0x3ff);
            }
            self.loaded = self.next(self.loaded) % NONE;
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
