use std::vec::Vec;

use plumb_emulator::tmc2209::{Driver, Trouble, Wire};
use plumb_protocol::boards::SKR_PICO;
use plumb_protocol::message::{DriverFault, DriverReading};
use plumb_protocol::wiring::{Chopper, Tmc2209};

use super::super::EXCHANGE_US;
use super::{Event, Monitor};
use crate::tmc2209::Settings;

/// Addresses of the drivers of motors A, B and C on an SKR Pico; its driver E has 3.
const ADDRESSES: [u8; 3] = SKR_PICO.driver_uart.addresses;

fn settings(chopper: Chopper) -> Settings {
    Settings::new(&Tmc2209 { chopper, ..Tmc2209::of(&SKR_PICO) }, 16).unwrap()
}

/// Returns the fault of a motor's driver.
type FaultOf = fn(u8) -> DriverFault;

/// A monitor with its drivers.
struct Bench {
    monitor: Monitor,
    wire: Wire,
    /// Exchanges so far.
    exchanges: u32,
}

impl Bench {
    fn new() -> Self {
        Self::with(settings(Chopper::StealthChop))
    }

    fn with(settings: Settings) -> Self {
        let drivers = ADDRESSES.into_iter().chain([3]).zip(0..).map(|(a, m)| Driver::new(a, m));
        let wire = Wire { drivers: drivers.collect(), directions: [false; 3] };
        Self { monitor: Monitor::new(settings), wire, exchanges: 0 }
    }

    /// Carries out an exchange, whose received bytes `disturb` may change.
    fn disturbed(&mut self, disturb: impl Fn(u32, &mut Vec<u8>)) -> Option<Event> {
        let exchange = self.monitor.exchange()?;
        self.wire.directions = exchange.directions.unwrap_or_default();
        let mut received = self.wire.send(exchange.bytes());
        disturb(self.exchanges, &mut received);
        self.exchanges += 1;
        self.monitor.take(&received)
    }

    /// Goes on until there is an event other than readings, for 1000 exchanges at most.
    fn event(&mut self) -> Option<Event> {
        (0..1000)
            .filter_map(|_| self.disturbed(|_, _| {}))
            .find(|event| !matches!(event, Event::Readings(_)))
    }

    fn ready() -> Self {
        let mut bench = Self::new();
        assert_eq!(bench.event(), Some(Event::Ready));
        bench
    }

    /// Sets the register of a motor's driver.
    fn set(&mut self, motor: usize, register: u8, value: u32) {
        self.wire.drivers[motor].registers.insert(register, value);
    }

    /// Returns the next readings.
    fn readings(&mut self) -> [DriverReading; 3] {
        let readings = (0..1000).find_map(|_| match self.disturbed(|_, _| {}) {
            Some(Event::Readings(readings)) => Some(readings),
            _ => None,
        });
        readings.unwrap()
    }
}

#[test]
fn drivers_are_set_up_and_found_at_their_addresses() {
    let mut bench = Bench::new();
    assert_eq!(bench.event(), Some(Event::Ready));
    for driver in &bench.wire.drivers[..3] {
        let registers = [0x00, 0x01, 0x03, 0x10, 0x6c].map(|at| driver.registers[&at]);
        assert_eq!(registers, [0x1c0, 0, 0x200, 0x0008_1919, 0x1403_0053]);
        assert_eq!(driver.count, 250_u8.wrapping_add(12), "IFCNT wraps meanwhile");
    }
    let other = &bench.wire.drivers[3];
    assert_eq!(other.written, [(0x03, 0x200)], "the driver without a motor only waits longer");
    // 4 delays, 3 times 14 for a driver, 12 readings of DIR.
    assert_eq!(bench.exchanges, 58);
}

#[test]
fn each_fault_of_a_driver_is_found_in_a_round_with_its_motor() {
    // Register, value, fault.
    let faults: [(u8, u32, FaultOf); 9] = [
        (0x01, 1, DriverFault::Reset),
        (0x01, 1 << 2, DriverFault::Undervoltage),
        (0x01, 1 << 1, DriverFault::Overtemperature),
        (0x6f, 0b11, DriverFault::Overtemperature),
        (0x6f, 1 << 2, DriverFault::Short),
        (0x6f, 1 << 3, DriverFault::Short),
        (0x6f, 1 << 4, DriverFault::Short),
        (0x6f, 1 << 5, DriverFault::Short),
        (0x6f, 1 << 5 | 1 << 1, DriverFault::Short),
    ];
    for motor in 0..3 {
        for (register, value, fault) in faults {
            for offset in 0..7 {
                let mut bench = Bench::ready();
                (0..offset).for_each(|_| assert_eq!(bench.disturbed(|_, _| {}), None));
                bench.set(usize::from(motor), register, value);
                bench.exchanges = 0;
                assert_eq!(bench.event(), Some(Event::Failed(fault(motor))), "{register} {value}");
                // A round and the rest of one, in which GSTAT was read already.
                assert!(bench.exchanges <= 8, "{} exchanges", bench.exchanges);
                assert!(bench.monitor.has_failed() && bench.monitor.exchange().is_none());
            }
        }
    }
}

#[test]
fn a_silent_driver_is_named() {
    for motor in 0..3 {
        let mut bench = Bench::new();
        bench.wire.drivers[usize::from(motor)].set_trouble(Some(Trouble::Silent));
        assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Silent(motor))));
        let mut bench = Bench::ready();
        bench.exchanges = 0;
        bench.wire.drivers[usize::from(motor)].set_trouble(Some(Trouble::Silent));
        assert!(bench.readings()[usize::from(motor)].has_lost_replies);
        assert!(bench.exchanges <= 2 * 7 + 3, "a warning in two rounds");
        assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Silent(motor))));
        // Within a round after 0.3 s.
        assert!((200..=212).contains(&bench.exchanges), "{} exchanges", bench.exchanges);
    }
}

#[test]
fn a_fault_is_found_while_another_driver_is_silent() {
    let mut bench = Bench::ready();
    bench.wire.drivers[0].set_trouble(Some(Trouble::Silent));
    assert!(bench.readings()[0].has_lost_replies);
    bench.set(2, 0x6f, 1 << 2);
    bench.exchanges = 0;
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Short(2))));
    assert!(bench.exchanges <= 12, "{} exchanges", bench.exchanges);
}

/// Returns the number of writes that each driver got.
fn writes(bench: &Bench) -> Vec<usize> {
    bench.wire.drivers.iter().map(|driver| driver.written.len()).collect()
}

#[test]
fn a_set_up_after_a_fault_leaves_the_current_of_the_other_drivers() {
    let troubles =
        [Trouble::Short, Trouble::Overtemperature, Trouble::Undervoltage, Trouble::Reset];
    for motor in 0..3 {
        for trouble in troubles {
            let mut bench = Bench::ready();
            let before = writes(&bench);
            bench.wire.drivers[motor].set_trouble(Some(trouble));
            assert!(matches!(bench.event(), Some(Event::Failed(_))), "{trouble:?}");
            bench.wire.drivers[motor].set_trouble(None);
            bench.monitor.set_up_again();
            assert_eq!(bench.event(), Some(Event::Ready), "{trouble:?}");
            let mut expected = before;
            expected[motor] += 11;
            assert_eq!(writes(&bench), expected, "{trouble:?} of motor {motor}");
            assert_eq!(bench.wire.drivers[motor].registers[&0x6c], 0x1403_0053);
        }
    }
    // A supply that all drivers have lost: one set-up brings all back.
    let mut bench = Bench::ready();
    let drivers = &mut bench.wire.drivers;
    drivers.iter_mut().for_each(|driver| driver.set_trouble(Some(Trouble::Reset)));
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Reset(0))));
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Ready));
    let chopper = bench.wire.drivers[..3].iter().map(|driver| driver.registers[&0x6c]);
    assert!(chopper.eq([0x1403_0053; 3]));
}

#[test]
fn a_driver_that_answers_again_is_set_up_only_where_it_lost_its_settings() {
    let silent = |bench: &mut Bench| {
        bench.wire.drivers[1].set_trouble(Some(Trouble::Silent));
        assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Silent(1))));
        bench.wire.drivers[1].set_trouble(None);
    };
    let mut bench = Bench::ready();
    let before = writes(&bench);
    silent(&mut bench);
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Ready));
    assert_eq!(writes(&bench), before, "nothing");
    // Its supply was off meanwhile.
    silent(&mut bench);
    bench.wire.drivers[1].set_trouble(Some(Trouble::Reset));
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Ready));
    assert_eq!(writes(&bench)[1], before[1] + 11);
    // Another program on the wire has written to it.
    let mut bench = Bench::ready();
    silent(&mut bench);
    bench.wire.drivers[1].count += 1;
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Ready));
    assert_eq!(writes(&bench), [12, 23, 12, 1]);
}

#[test]
fn a_chip_that_is_no_tmc2209_is_named() {
    let mut bench = Bench::new();
    // A TMC2208 answers with version 0x20.
    let disturb = |_: u32, received: &mut Vec<u8>| {
        if let [5, 2, 6, _, 5, 0xff, 6, version, rest @ ..] = &mut received[..] {
            *version = 0x20;
            let check = super::super::datagram::crc(&[5, 0xff, 6, 0x20, rest[0], rest[1], rest[2]]);
            rest[3] = check;
        }
    };
    let event = (0..1000).find_map(|_| bench.disturbed(disturb));
    assert_eq!(event, Some(Event::Failed(DriverFault::Version(1))));
}

#[test]
fn noise_is_outlived_and_a_line_that_stays_damaged_is_named() {
    let flip = |received: &mut Vec<u8>| {
        if let Some(last) = received.last_mut() {
            *last ^= 0x10;
        }
    };
    // Two of three exchanges are damaged: each attempt but the last.
    let mut bench = Bench::new();
    let mostly = |exchange: u32, received: &mut Vec<u8>| {
        if exchange % 3 != 2 {
            flip(received);
        }
    };
    let mut events = (0..3000).filter_map(|_| bench.disturbed(mostly));
    assert_eq!(events.next(), Some(Event::Ready));
    assert!(events.all(|event| matches!(event, Event::Readings(_))), "no fault");
    // A fault is found within 50 ms meanwhile.
    bench.set(2, 0x6f, 1 << 2);
    bench.exchanges = 0;
    let event = (0..100).find_map(|_| bench.disturbed(mostly));
    assert_eq!(event, Some(Event::Failed(DriverFault::Short(2))));
    assert!(bench.exchanges * EXCHANGE_US < 50_000, "{} exchanges", bench.exchanges);

    // Noise of 0.28 s is a warning, which goes once it has ended.
    let mut bench = Bench::ready();
    let before = writes(&bench);
    let events = (0..187).filter_map(|_| bench.disturbed(|_, received| flip(received)));
    let events = events.collect::<Vec<_>>();
    let lost = |event: &Event| match event {
        Event::Readings(readings) => readings.iter().all(|reading| reading.has_lost_replies),
        _ => false,
    };
    assert!(!events.is_empty() && events.iter().all(lost), "{events:?}");
    // The first readings are those of the round in which it ended.
    bench.readings();
    assert!(bench.readings().iter().all(|reading| !reading.has_lost_replies));
    // A line that stays damaged for longer is a fault, after which nothing is written.
    let event = (0..250).find_map(|_| match bench.disturbed(|_, received| flip(received)) {
        Some(Event::Readings(_)) => None,
        event => event,
    });
    assert!(matches!(event, Some(Event::Failed(DriverFault::BadReplies(_)))), "{event:?}");
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Ready));
    assert_eq!(writes(&bench), before);
}

#[test]
fn a_driver_that_loses_a_write_is_set_up_once_more() {
    let mut bench = Bench::new();
    // The first driver has not counted one of the writes.
    for _ in 0..13 {
        bench.disturbed(|_, _| {});
    }
    bench.wire.drivers[0].count = bench.wire.drivers[0].count.wrapping_sub(1);
    assert_eq!(bench.event(), Some(Event::Ready));
    assert_eq!(bench.wire.drivers[0].written.len(), 1 + 2 * 11);
    assert_eq!(bench.wire.drivers[1].written.len(), 1 + 11);
}

#[test]
fn two_drivers_on_one_address_and_exchanged_addresses_are_named() {
    // A driver without a motor here, such as E, has the address of B, and DIR low or high.
    for motor in [3, 4] {
        let mut bench = Bench::new();
        (bench.wire.drivers[3].address, bench.wire.drivers[3].motor) = (ADDRESSES[1], motor);
        assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Address(1))));
    }
    // A and C are exchanged.
    let mut bench = Bench::new();
    bench.wire.drivers[0].address = ADDRESSES[2];
    bench.wire.drivers[2].address = ADDRESSES[0];
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Address(0))));
    // The address of C is empty, since C has that of A.
    let mut bench = Bench::new();
    bench.wire.drivers[2].address = ADDRESSES[0];
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Silent(2))));
}

#[test]
fn directions_are_set_only_before_the_drivers_are_on() {
    let mut bench = Bench::ready();
    bench.set(0, 0x6f, 1 << 2);
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Short(0))));
    bench.monitor.set_up_again();
    let ready = (0..1000).find_map(|_| {
        assert!(bench.monitor.exchange().is_some_and(|exchange| exchange.directions.is_none()));
        bench.disturbed(|_, _| {})
    });
    assert_eq!(ready, Some(Event::Ready), "switching the coils off ends the short's flag");
    // A set-up that failed before the drivers were on checks them the next time.
    let mut bench = Bench::new();
    bench.wire.drivers[3].address = ADDRESSES[1];
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Address(1))));
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Address(1))));
}

#[test]
fn a_driver_that_was_reset_gets_its_settings_again() {
    let mut bench = Bench::ready();
    bench.wire.drivers[1].set_trouble(Some(Trouble::Reset));
    assert_eq!(bench.event(), Some(Event::Failed(DriverFault::Reset(1))));
    bench.monitor.set_up_again();
    assert_eq!(bench.event(), Some(Event::Ready));
    assert_eq!(bench.wire.drivers[1].registers[&0x6c], 0x1403_0053);
}

#[test]
fn warnings_are_reported_when_they_come_and_go() {
    let mut bench = Bench::ready();
    bench.set(1, 0x41, 0x1fe);
    let readings = bench.readings();
    assert_eq!(readings.map(|it| it.stall_guard), [Some(0), Some(0x1fe), Some(0)]);
    assert_eq!(readings.map(|it| (it.is_hot, it.has_open_load)), [(false, false); 3]);
    bench.exchanges = 0;
    bench.wire.drivers[2].set_trouble(Some(Trouble::Hot));
    assert!(bench.readings()[2].is_hot);
    assert!(bench.exchanges <= 7, "in the same round");
    // An open coil counts while the motor turns, in two polls in a row.
    bench.wire.drivers[2].set_trouble(Some(Trouble::OpenCoil));
    assert!(!bench.readings()[2].has_open_load, "at standstill");
    bench.wire.drivers[2].is_standing = false;
    bench.exchanges = 0;
    assert!(bench.readings()[2].has_open_load);
    assert!((8..=14).contains(&bench.exchanges), "{} exchanges", bench.exchanges);
    bench.wire.drivers[2].is_standing = true;
    assert!(!bench.readings()[2].has_open_load);
}

#[test]
fn spread_cycle_has_no_reading_of_stall_guard() {
    let mut bench = Bench::with(settings(Chopper::SpreadCycle));
    assert_eq!(bench.event(), Some(Event::Ready));
    bench.exchanges = 0;
    assert_eq!(bench.readings().map(|it| it.stall_guard), [None; 3]);
    assert_eq!(bench.exchanges, 60, "ten rounds of six");
}
