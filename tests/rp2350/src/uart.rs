//! The host's end of UART0.
//!
//! The emulator's UART has no receiver, but a loop-back: what is transmitted is received. So with
//! the loop-back on, what the firmware transmits is taken from the receiver before the firmware
//! looks there. A byte for the firmware is transmitted in the firmware's place, while it transmits
//! nothing itself; then the transmitter stands still until the firmware has taken the byte. The
//! clock of the transmitter is faster than the firmware sets it, so that it is never in the way.

use std::collections::VecDeque;

use rp2350_emu::Emulator;

const BASE: u32 = 0x4007_0000;
/// Data.
const DR: u32 = BASE;
/// Flags: the receiver is empty; the transmitter is empty.
const FR: u32 = BASE + 0x18;
const RECEIVER_EMPTY: u32 = 1 << 4;
const TRANSMITTER_EMPTY: u32 = 1 << 7;
/// Divisor of the clock, whole and in 1/64.
const IBRD: u32 = BASE + 0x24;
const FBRD: u32 = BASE + 0x28;
/// Control: enabled, loop-back.
const CR: u32 = BASE + 0x30;
const ENABLED: u32 = 1;
const LOOP_BACK: u32 = 1 << 7;
/// Number of UART0's interrupt.
const INTERRUPT: u32 = 33;
/// Divisor with which a byte takes 160 clocks; 0 stops the clock.
const FAST: u32 = 1;

/// What is under way to the firmware.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ToFirmware {
    Nothing,
    /// A byte in the transmitter.
    Transmitted,
    /// A byte in the receiver, and the transmitter stands still.
    Received,
}

/// The host's end.
pub struct Uart {
    /// Bytes that wait for the line.
    waiting: VecDeque<u8>,
    /// Cycle from which on the line is free for the next byte.
    free_at: u64,
    /// Cycles of a byte.
    byte: u64,
    under_way: ToFirmware,
    is_looped: bool,
}

impl Uart {
    /// Creates a line on which a byte takes `byte` cycles.
    pub fn new(byte: u64) -> Self {
        let under_way = ToFirmware::Nothing;
        Self { waiting: VecDeque::new(), free_at: 0, byte, under_way, is_looped: false }
    }

    /// Changes the cycles of a byte.
    pub fn set_byte(&mut self, cycles: u64) {
        self.byte = cycles;
    }

    /// Sends bytes to the firmware, one after the other.
    pub fn send(&mut self, bytes: &[u8]) {
        self.waiting.extend(bytes);
    }

    /// Returns whether all bytes were received.
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.under_way == ToFirmware::Nothing
    }

    /// Moves bytes, after each quantum of at most 128 cycles. Returns a byte that the firmware has
    /// transmitted.
    pub fn step(&mut self, emulator: &mut Emulator) -> Option<u8> {
        if !self.is_looped {
            if emulator.mmio_read32(CR) & ENABLED == 0 {
                return None;
            }
            emulator.mmio_write32(CR + 0x2000, LOOP_BACK);
            emulator.mmio_write32(FBRD, 0);
            emulator.mmio_write32(IBRD, FAST);
            self.is_looped = true;
        }
        let flags = emulator.mmio_read32(FR);
        let has_received = flags & RECEIVER_EMPTY == 0;
        match self.under_way {
            ToFirmware::Received if !has_received => {
                emulator.mmio_write32(IBRD, FAST);
                self.under_way = ToFirmware::Nothing;
                None
            }
            ToFirmware::Transmitted if has_received => {
                emulator.mmio_write32(IBRD, 0);
                emulator.bus.atomics.assert_irq_shared(INTERRUPT);
                self.under_way = ToFirmware::Received;
                None
            }
            ToFirmware::Received | ToFirmware::Transmitted => None,
            ToFirmware::Nothing if has_received => Some(emulator.mmio_read32(DR) as u8),
            ToFirmware::Nothing => {
                if flags & TRANSMITTER_EMPTY != 0
                    && emulator.cycles() >= self.free_at
                    && let Some(byte) = self.waiting.pop_front()
                {
                    emulator.mmio_write32(DR, byte.into());
                    self.free_at = emulator.cycles() + self.byte;
                    self.under_way = ToFirmware::Transmitted;
                }
                None
            }
        }
    }
}
