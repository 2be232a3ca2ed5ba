//! Emulated TMC2209 drivers on a wire, from the data sheet rev. 1.09: registers, CRC, IFCNT,
//! replies. Written apart from the firmware's datagrams and registers, which they test.

use std::collections::BTreeMap;

/// Registers (chapter 5).
mod register {
    pub(super) const GCONF: u8 = 0x00;
    pub(super) const GSTAT: u8 = 0x01;
    pub(super) const IFCNT: u8 = 0x02;
    pub(super) const IOIN: u8 = 0x06;
    pub(super) const CHOPCONF: u8 = 0x6c;
    pub(super) const DRV_STATUS: u8 = 0x6f;
}

/// GCONF, GSTAT, CHOPCONF and DRV_STATUS after a reset, at standstill.
const AFTER_RESET: [(u8, u32); 4] = [
    (register::GCONF, 0x141),
    (register::GSTAT, 1),
    (register::CHOPCONF, 0x1000_0053),
    (register::DRV_STATUS, 1 << 31 | 1 << 30),
];
/// CHOPCONF: `toff`, which switches the coils on.
const TOFF: u32 = 0b1111;
/// DRV_STATUS: a short circuit of a coil.
const SHORT: u32 = 0b1111 << 2;
/// IOIN: the version.
const VERSION: u32 = 0x21 << 24;

/// An emulated TMC2209.
#[derive(Debug, Clone)]
pub struct Driver {
    /// Address by its pins MS1 and MS2, 0 to 3.
    pub address: u8,
    /// The motor whose DIR pin it is connected to. DIR of motor 3 is always low, of 4 high.
    pub motor: u8,
    /// Registers that were written or have a value after a reset; the others are 0.
    pub registers: BTreeMap<u8, u32>,
    /// Whether it answers nothing.
    pub is_silent: bool,
    /// Accepted writes; wraps.
    pub count: u8,
    /// All writes in their order: register and value.
    pub written: Vec<(u8, u32)>,
}

impl Driver {
    /// Returns a driver after power-on, at standstill.
    pub fn new(address: u8, motor: u8) -> Self {
        let registers = BTreeMap::from(AFTER_RESET);
        Self { address, motor, registers, is_silent: false, count: 250, written: Vec::new() }
    }

    /// Sets the registers as a reset leaves them.
    pub fn reset(&mut self) {
        self.registers = BTreeMap::from(AFTER_RESET);
    }

    /// Returns the reply to a datagram; `None` to a write, a damaged one or that of another driver.
    fn answer(&mut self, datagram: &[u8], directions: [bool; 3]) -> Option<[u8; 8]> {
        let (check, body) = datagram.split_last()?;
        let (&[_, address, register], data) = body.split_first_chunk()?;
        if self.is_silent || address != self.address || crc(body) != *check {
            return None;
        }
        if let [a, b, c, d] = *data {
            self.write(register & 0x7f, u32::from_be_bytes([a, b, c, d]));
            return None;
        }
        let [a, b, c, d] = self.read(register, directions).to_be_bytes();
        let mut reply = [5, 0xff, register, a, b, c, d, 0];
        reply[7] = crc(&reply[..7]);
        Some(reply)
    }

    /// Returns the value of a register.
    fn read(&self, register: u8, directions: [bool; 3]) -> u32 {
        match register {
            register::IFCNT => u32::from(self.count),
            register::IOIN => {
                let [a, b, c] = directions;
                let is_high = [a, b, c, false, true][usize::from(self.motor)];
                VERSION | u32::from(is_high) << 9 | u32::from(self.address) << 2
            }
            register => self.registers.get(&register).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, register: u8, value: u32) {
        self.count = self.count.wrapping_add(1);
        self.written.push((register, value));
        if register == register::GSTAT {
            *self.registers.entry(register).or_default() &= !value;
            return;
        }
        if register == register::CHOPCONF && value & TOFF == 0 {
            // The flags of a short circuit end (section 5.5.3).
            *self.registers.entry(register::DRV_STATUS).or_default() &= !SHORT;
        }
        self.registers.insert(register, value);
    }
}

/// A wire with drivers: low wins.
#[derive(Debug, Clone)]
pub struct Wire {
    /// The drivers.
    pub drivers: Vec<Driver>,
    /// Levels of DIR of motors A, B and C.
    pub directions: [bool; 3],
}

impl Wire {
    /// Returns what arrives after a datagram: its echo, and the replies.
    pub fn send(&mut self, datagram: &[u8]) -> Vec<u8> {
        let mut received = datagram.to_vec();
        let directions = self.directions;
        let replies = self.drivers.iter_mut().filter_map(|it| it.answer(datagram, directions));
        let collided =
            replies.reduce(|one, other| [0, 1, 2, 3, 4, 5, 6, 7].map(|i| one[i] & other[i]));
        received.extend(collided.into_iter().flatten());
        received
    }
}

/// Returns the CRC of a datagram, as the program in section 4.2 computes it.
fn crc(datagram: &[u8]) -> u8 {
    let mut crc = 0_u8;
    for byte in datagram {
        for bit in 0..8 {
            let is_set = (crc >> 7) ^ (byte >> bit & 1) == 1;
            crc = crc << 1 ^ if is_set { 0x07 } else { 0 };
        }
    }
    crc
}
