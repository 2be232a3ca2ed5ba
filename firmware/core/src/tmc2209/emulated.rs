//! Emulated drivers on a wire, from the data sheet: registers, CRC, IFCNT, replies.

use std::collections::BTreeMap;
use std::vec::Vec;

use super::datagram::crc;

/// An emulated TMC2209.
#[derive(Debug, Clone)]
pub(super) struct Driver {
    pub(super) address: u8,
    /// The motor whose DIR pin it is connected to. DIR of motor 3 is always low, of 4 high.
    pub(super) motor: u8,
    pub(super) registers: BTreeMap<u8, u32>,
    pub(super) is_silent: bool,
    /// Accepted writes; wraps.
    pub(super) count: u8,
    /// All writes, in their order.
    pub(super) written: Vec<(u8, u32)>,
}

impl Driver {
    /// Returns a driver after power-on, at standstill.
    pub(super) fn new(address: u8, motor: u8) -> Self {
        let mut driver = Self {
            address,
            motor,
            registers: BTreeMap::new(),
            is_silent: false,
            count: 250,
            written: Vec::new(),
        };
        driver.reset();
        driver
    }

    /// Sets the registers as a reset leaves them.
    pub(super) fn reset(&mut self) {
        self.registers =
            BTreeMap::from([(0, 0x141), (1, 1), (0x6c, 0x1000_0053), (0x6f, 1 << 31 | 1 << 30)]);
    }

    /// Returns the reply to a datagram.
    fn answer(&mut self, datagram: &[u8], directions: [bool; 3]) -> Option<[u8; 8]> {
        let (check, body) = datagram.split_last()?;
        if self.is_silent || body[1] != self.address || crc(body) != *check {
            return None;
        }
        if let [_, _, register, a, b, c, d] = *body {
            self.write(register & 0x7f, u32::from_be_bytes([a, b, c, d]));
            return None;
        }
        let value = match body[2] {
            2 => u32::from(self.count),
            6 => {
                let [a, b, c] = directions;
                let is_high = [a, b, c, false, true][usize::from(self.motor)];
                0x2100_0000 | u32::from(is_high) << 9 | u32::from(self.address) << 2
            }
            register => *self.registers.get(&register).unwrap_or(&0),
        };
        let [a, b, c, d] = value.to_be_bytes();
        let mut reply = [5, 0xff, body[2], a, b, c, d, 0];
        reply[7] = crc(&reply[..7]);
        Some(reply)
    }

    fn write(&mut self, register: u8, value: u32) {
        self.count = self.count.wrapping_add(1);
        self.written.push((register, value));
        match register {
            1 => *self.registers.entry(1).or_default() &= !value,
            // Without `toff` the flags of a short circuit end.
            0x6c if value & 0xf == 0 => *self.registers.entry(0x6f).or_default() &= !(0xf << 2),
            _ => {}
        }
        if register != 1 {
            self.registers.insert(register, value);
        }
    }
}

/// A wire with drivers: low wins.
#[derive(Debug, Clone)]
pub(super) struct Wire {
    pub(super) drivers: Vec<Driver>,
    /// Levels of DIR of motors A, B and C.
    pub(super) directions: [bool; 3],
}

impl Wire {
    /// Returns what arrives after a datagram: its echo, and the replies.
    pub(super) fn send(&mut self, datagram: &[u8]) -> Vec<u8> {
        let mut received = datagram.to_vec();
        let directions = self.directions;
        let replies = self.drivers.iter_mut().filter_map(|it| it.answer(datagram, directions));
        let collided =
            replies.reduce(|one, other| [0, 1, 2, 3, 4, 5, 6, 7].map(|i| one[i] & other[i]));
        received.extend(collided.into_iter().flatten());
        received
    }
}
