//! Emulated TMC2209 drivers on a wire, from the data sheet rev. 1.09: registers, CRC, IFCNT,
//! replies, and what troubles a driver. Written apart from the firmware's datagrams and registers,
//! which they test.
//!
//! Left out: the present current (CS_ACTUAL), the comparators of the temperature (t120 to t157) and
//! the hysteresis of the shut-down. A motor stands as soon as its rate is 0, without the driver's
//! wait of 2^20 clocks.

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

/// GCONF, GSTAT, CHOPCONF and DRV_STATUS after a reset.
const AFTER_RESET: [(u8, u32); 4] = [
    (register::GCONF, 0x141),
    (register::GSTAT, 1),
    (register::CHOPCONF, 0x1000_0053),
    (register::DRV_STATUS, 1 << 30),
];
/// CHOPCONF: `toff`, which switches the coils on.
const TOFF: u32 = 0b1111;

/// Flags of GSTAT (section 5.1).
mod gstat {
    /// The driver has switched off for its temperature or a short circuit; kept.
    pub(super) const DRV_ERR: u32 = 1 << 1;
    /// The charge pump has too low a voltage; not kept.
    pub(super) const UV_CP: u32 = 1 << 2;
}

/// Flags of DRV_STATUS (section 5.5.3).
mod drv_status {
    /// The temperature is above that of the warning.
    pub(super) const OTPW: u32 = 1;
    /// The temperature is above that of the shut-down.
    pub(super) const OT: u32 = 1 << 1;
    /// A coil of phase A is shorted to ground.
    pub(super) const S2GA: u32 = 1 << 2;
    /// Any short circuit.
    pub(super) const SHORTS: u32 = 0b1111 << 2;
    /// Phase A has no current.
    pub(super) const OLA: u32 = 1 << 6;
    /// The motor stands.
    pub(super) const STST: u32 = 1 << 31;
}

/// IOIN: the version.
const VERSION: u32 = 0x21 << 24;

/// Trouble of a driver: two that it warns of, and five with which it fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Trouble {
    /// Above 120 °C: a warning
    Hot,
    /// A coil without current: a warning while the motor turns
    OpenCoil,
    /// Above 150 °C: the driver switches off
    Overtemperature,
    /// A short circuit of a coil
    Short,
    /// Too low a supply voltage
    Undervoltage,
    /// The loss of all settings, as without supply
    Reset,
    /// No answer
    Silent,
}

impl Trouble {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Hot,
        Self::OpenCoil,
        Self::Overtemperature,
        Self::Short,
        Self::Undervoltage,
        Self::Reset,
        Self::Silent,
    ];
}

/// An emulated TMC2209.
#[derive(Debug, Clone)]
pub struct Driver {
    /// Address by its pins MS1 and MS2, 0 to 3.
    pub address: u8,
    /// The motor whose DIR pin it is connected to. DIR of motor 3 is always low, of 4 high.
    pub motor: u8,
    /// Registers that were written or have a value after a reset; the others are 0.
    pub registers: BTreeMap<u8, u32>,
    /// Whether its motor stands.
    pub is_standing: bool,
    trouble: Option<Trouble>,
    /// Accepted writes; wraps.
    pub count: u8,
    /// All writes in their order: register and value.
    pub written: Vec<(u8, u32)>,
}

impl Driver {
    /// Returns a driver after power-on, at standstill.
    pub fn new(address: u8, motor: u8) -> Self {
        Self {
            address,
            motor,
            registers: BTreeMap::from(AFTER_RESET),
            is_standing: true,
            trouble: None,
            count: 250,
            written: Vec::new(),
        }
    }

    /// Sets what troubles the driver from now on.
    pub fn set_trouble(&mut self, trouble: Option<Trouble>) {
        let was = std::mem::replace(&mut self.trouble, trouble);
        if trouble == Some(Trouble::Reset) && was != trouble {
            (self.registers, self.count) = (BTreeMap::from(AFTER_RESET), 0);
        }
        self.keep_flags();
    }

    /// Returns the reply to a datagram; `None` to a write, a damaged one or that of another driver.
    fn answer(&mut self, datagram: &[u8], directions: [bool; 3]) -> Option<[u8; 8]> {
        let (check, body) = datagram.split_last()?;
        let (&[_, address, register], data) = body.split_first_chunk()?;
        if self.trouble == Some(Trouble::Silent) || address != self.address || crc(body) != *check {
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

    /// Returns the value of a register that is read.
    fn read(&mut self, register: u8, directions: [bool; 3]) -> u32 {
        self.keep_flags();
        let is_troubled_by = |trouble| self.trouble == Some(trouble);
        match register {
            register::GSTAT if is_troubled_by(Trouble::Undervoltage) => {
                self.value(register) | gstat::UV_CP
            }
            register::DRV_STATUS => self.value(register) | self.present_flags(),
            register::IFCNT => u32::from(self.count),
            register::IOIN => {
                let [a, b, c] = directions;
                let is_high = [a, b, c, false, true][usize::from(self.motor)];
                VERSION | u32::from(is_high) << 9 | u32::from(self.address) << 2
            }
            register => self.value(register),
        }
    }

    /// Returns the stored value of a register.
    fn value(&self, register: u8) -> u32 {
        self.registers.get(&register).copied().unwrap_or(0)
    }

    /// Returns whether the coils are on by CHOPCONF.
    fn is_on(&self) -> bool {
        self.value(register::CHOPCONF) & TOFF != 0
    }

    /// Returns whether the driver gives its motor current while ENABLE is on.
    pub fn has_current(&self) -> bool {
        self.is_on()
            && self.value(register::GSTAT) & gstat::DRV_ERR == 0
            && self.trouble != Some(Trouble::Undervoltage)
    }

    /// Stores the flags that outlive their reason (section 5.5.3).
    fn keep_flags(&mut self) {
        let is_shorted = self.trouble == Some(Trouble::Short) && self.is_on();
        if is_shorted {
            *self.registers.entry(register::DRV_STATUS).or_default() |= drv_status::S2GA;
        }
        if is_shorted || self.trouble == Some(Trouble::Overtemperature) {
            *self.registers.entry(register::GSTAT).or_default() |= gstat::DRV_ERR;
        }
    }

    /// Returns the flags of DRV_STATUS that end with their reason.
    fn present_flags(&self) -> u32 {
        let standing = if self.is_standing { drv_status::STST } else { 0 };
        standing
            | match self.trouble {
                Some(Trouble::Hot) => drv_status::OTPW,
                Some(Trouble::Overtemperature) => drv_status::OTPW | drv_status::OT,
                Some(Trouble::OpenCoil) if self.is_on() => drv_status::OLA,
                _ => 0,
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
            *self.registers.entry(register::DRV_STATUS).or_default() &= !drv_status::SHORTS;
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
