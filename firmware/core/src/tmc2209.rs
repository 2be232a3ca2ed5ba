//! TMC2209 motor drivers on one UART (Trinamic's data sheet rev. 1.09): datagrams, registers, and
//! the monitor that sets up the drivers and watches them. No hardware: the chip's program sends
//! each [`Exchange`] and passes on the bytes that arrived.
//!
//! ```text
//! Monitor::exchange -> request -> UART -> single wire, with an echo -> reply -> Monitor::take
//!         set up (registers, IFCNT, version) -> DIR of each driver -> Ready
//!         poll: GSTAT and DRV_STATUS of each, one SG_RESULT -> Failed, Readings
//!         after a failure: GSTAT and IFCNT of each -> set-up of those that need it -> Ready
//! ```
//!
//! # Time to a fault
//! An exchange takes [`EXCHANGE_US`], and a round over three drivers has seven: 10.5 ms. A flag of
//! a driver is found after eight exchanges at most, 12 ms. A damaged or missing reply is asked for
//! again up to twice: with two of three replies damaged a flag is found after 36 ms at most. A
//! driver whose poll has no reply for 0.3 s has failed; before that its reading has a warning.

mod datagram;
mod monitor;
mod settings;

pub use datagram::{Exchange, MAX_RECEIVED};
pub use monitor::{Event, Monitor};
pub use settings::Settings;

/// Rate of the UART, bit/s. The drivers take 9600 to 500 000 (section 4.1) and follow the host's.
pub const BAUD: u32 = 115_200;

/// Time from one request to the next, µs. The longest exchange, a read, is 40 bits of request, a
/// pause of 24 bits, 80 bits of reply and 4 bits until the driver lets the line go: 1.29 ms. The
/// line then rests for 12 bits or more, which the drivers need to begin anew (section 4.1.1).
pub const EXCHANGE_US: u32 = 1500;

/// Registers (chapter 5).
mod register {
    pub(super) const GCONF: u8 = 0x00;
    pub(super) const GSTAT: u8 = 0x01;
    pub(super) const IFCNT: u8 = 0x02;
    pub(super) const NODECONF: u8 = 0x03;
    pub(super) const IOIN: u8 = 0x06;
    pub(super) const IHOLD_IRUN: u8 = 0x10;
    pub(super) const TPOWERDOWN: u8 = 0x11;
    pub(super) const TPWMTHRS: u8 = 0x13;
    pub(super) const VACTUAL: u8 = 0x22;
    pub(super) const SG_RESULT: u8 = 0x41;
    pub(super) const COOLCONF: u8 = 0x42;
    pub(super) const CHOPCONF: u8 = 0x6c;
    pub(super) const DRV_STATUS: u8 = 0x6f;
    pub(super) const PWMCONF: u8 = 0x70;
}
