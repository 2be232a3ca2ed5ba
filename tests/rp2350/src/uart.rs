//! UART0, whose receiver the emulator lacks (PL011; RP2350 datasheet, section 12.1).

use std::collections::VecDeque;

/// Places of both queues.
const DEPTH: usize = 32;
/// Fills at which a queue interrupts, in eighths, by the number in IFLS.
const EIGHTHS: [usize; 5] = [1, 2, 4, 6, 7];
/// IFLS after a reset: half of both queues.
const HALF: u32 = 0b010_010;
/// Bits without a byte after which received bytes interrupt.
const TIMEOUT_BITS: u64 = 32;
/// Bits of a byte with its frame.
const BITS: u64 = 10;

/// Offsets of the registers.
const DR: u32 = 0x00;
const FR: u32 = 0x18;
const IFLS: u32 = 0x34;
const IMSC: u32 = 0x38;
const RIS: u32 = 0x3c;
const MIS: u32 = 0x40;
const ICR: u32 = 0x44;

/// Flags.
const RECEIVER_EMPTY: u32 = 1 << 4;
const TRANSMITTER_FULL: u32 = 1 << 5;
const RECEIVER_FULL: u32 = 1 << 6;
const TRANSMITTER_EMPTY: u32 = 1 << 7;

/// Interrupts.
const RECEIVED: u32 = 1 << 4;
const TRANSMITTED: u32 = 1 << 5;
const TIMEOUT: u32 = 1 << 6;

/// The UART, with the host at its other end.
pub struct Uart {
    /// Cycles of a byte.
    byte: u64,
    /// Registers that only keep what is written, by offset/4.
    registers: [u32; 32],
    /// Interrupts that wait.
    raised: u32,
    received: VecDeque<u8>,
    to_send: VecDeque<u8>,
    /// Bytes of the host that wait for the line.
    waiting: VecDeque<u8>,
    /// Cycle at which the last byte was received.
    last: u64,
    /// Cycle from which on each direction of the line is free.
    free: [u64; 2],
    /// Bytes that the host has received.
    pub sent: Vec<u8>,
}

impl Uart {
    /// Creates a UART on a line on which a byte takes `byte` cycles.
    pub fn new(byte: u64) -> Self {
        let mut registers = [0; 32];
        registers[(IFLS / 4) as usize] = HALF;
        Self {
            byte,
            registers,
            raised: 0,
            received: VecDeque::new(),
            to_send: VecDeque::new(),
            waiting: VecDeque::new(),
            last: 0,
            free: [0; 2],
            sent: Vec::new(),
        }
    }

    /// Changes the cycles of a byte.
    pub fn set_byte(&mut self, cycles: u64) {
        self.byte = cycles;
    }

    /// Returns the cycle at which the last byte was received.
    pub fn last_byte(&self) -> u64 {
        self.last
    }

    /// Sends bytes to the firmware, one after the other.
    pub fn send(&mut self, bytes: &[u8]) {
        self.waiting.extend(bytes);
    }

    /// Returns whether the firmware has taken all bytes.
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.received.is_empty()
    }

    /// Returns the fill at which a queue interrupts: that of the receiver at bit 3 of IFLS, that of
    /// the transmitter at bit 0.
    fn level(&self, bit: u32) -> usize {
        let number = self.registers[(IFLS / 4) as usize] >> bit & 7;
        DEPTH / 8 * EIGHTHS.get(number as usize).unwrap_or(&4)
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            DR => self.received.pop_front().map_or(0, u32::from),
            FR => {
                let flag = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
                flag(self.received.is_empty(), RECEIVER_EMPTY)
                    | flag(self.received.len() >= DEPTH, RECEIVER_FULL)
                    | flag(self.to_send.is_empty(), TRANSMITTER_EMPTY)
                    | flag(self.to_send.len() >= DEPTH, TRANSMITTER_FULL)
            }
            RIS => self.raised,
            MIS => self.raised & self.registers[(IMSC / 4) as usize],
            _ => self.registers.get((offset / 4) as usize).copied().unwrap_or(0),
        }
    }

    /// Writes a register.
    pub fn write(&mut self, offset: u32, value: u32) {
        match offset {
            DR if self.to_send.len() < DEPTH => self.to_send.push_back(value as u8),
            DR => {}
            ICR => self.raised &= !value,
            _ => {
                if let Some(register) = self.registers.get_mut((offset / 4) as usize) {
                    *register = value;
                }
            }
        }
    }

    /// Moves bytes until `cycle`. Returns whether the UART interrupts.
    pub fn run(&mut self, cycle: u64) -> bool {
        let (receiver_level, transmitter_level) = (self.level(3), self.level(0));
        let [receiver, transmitter] = &mut self.free;
        if cycle >= *receiver
            && self.received.len() < DEPTH
            && let Some(byte) = self.waiting.pop_front()
        {
            self.received.push_back(byte);
            (self.last, *receiver) = (cycle, cycle + self.byte);
        }
        if cycle >= *transmitter
            && let Some(byte) = self.to_send.pop_front()
        {
            self.sent.push(byte);
            *transmitter = cycle + self.byte;
            if self.to_send.len() == transmitter_level {
                self.raised |= TRANSMITTED;
            }
        }
        self.raised &= !(RECEIVED | TIMEOUT);
        if self.received.len() >= receiver_level {
            self.raised |= RECEIVED;
        }
        if !self.received.is_empty() && cycle - self.last >= TIMEOUT_BITS * self.byte / BITS {
            self.raised |= TIMEOUT;
        }
        self.raised & self.registers[(IMSC / 4) as usize] != 0
    }
}
