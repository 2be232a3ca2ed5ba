//! The chip with the firmware in it.

use plumb_protocol::boards::PICO_2;
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, FromBoard, ToBoard};
use rp2350_emu::{Config, Emulator};

use crate::image::Firmware;
use crate::pins::Counter;
use crate::uart::Uart;

/// Processor cycles per microsecond.
pub const CYCLES_PER_US: u64 = 150;
/// Cycles of a tick.
pub const TICK: u64 = 200 * CYCLES_PER_US;

/// Address of the vectors in flash, and the register for it.
const VECTORS: u32 = 0x1000_0000;
const VTOR: u32 = 0xe000_ed08;
/// All peripherals in reset, as after power-on, save IO_BANK0 and PADS_BANK0 (RP2350 datasheet,
/// section 7.5.3): the emulator has no others that the firmware would not release.
const RESETS: u32 = 0x1fff_ffff & !(1 << 6 | 1 << 9);
/// Cycles of a byte at 115 200 baud with its two frame bits.
const BYTE: u64 = 10 * 150_000_000 / 115_200;
/// Cycles at the start in which every instruction is looked at.
const START: u64 = 1_000 * CYCLES_PER_US;
/// Most cycles that pass at once.
pub const QUANTUM: u32 = 64;

/// A running chip of a Pico 2 with a closed emergency loop.
pub struct Chip {
    emulator: Emulator,
    uart: Uart,
    accumulator: Accumulator,
    /// Cycles that pass at once: the pins are looked at as often.
    pub quantum: u32,
    /// The pulses at the pins of STEP and DIR.
    pub pins: Counter,
    /// All messages that the board has sent.
    pub received: Vec<FromBoard>,
    /// Id of the last command.
    id: u16,
}

impl Chip {
    /// Powers the chip on, and runs it until its serial line is open: 5 ms.
    ///
    /// # Panics
    /// If the firmware is shorter than its first two vectors.
    pub fn start(firmware: &Firmware) -> Self {
        let mut emulator = Emulator::new(Config::default());
        emulator.load_bootrom(&boot_rom());
        emulator.load_flash(&firmware.flash);
        emulator.bus.resets_state = RESETS;
        emulator.bus.gpio_external_mask = 1 << PICO_2.pins.emergency.number;
        emulator.bus.atomics.set_halted(1);
        emulator.mmio_write32(VTOR, VECTORS);
        let vectors = &firmware.flash[..8];
        let vector = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| vectors[4 * at + i]));
        let registers = &mut emulator.core_mut(0).regs;
        (registers.msp, registers.r[13], registers.xpsr) = (vector(0), vector(0), 1 << 24);
        registers.set_pc(vector(1) & !1);
        let mut chip = Self {
            emulator,
            uart: Uart::new(BYTE),
            accumulator: Accumulator::new(),
            quantum: QUANTUM,
            pins: Counter::new(&PICO_2.pins),
            received: Vec::new(),
            id: 0,
        };
        chip.run_us(5_000);
        chip
    }

    /// Returns the cycles since power-on.
    pub fn cycle(&self) -> u64 {
        self.emulator.cycles()
    }

    /// Returns the emulated chip.
    pub fn emulator(&self) -> &Emulator {
        &self.emulator
    }

    /// Runs the chip for `us` µs.
    pub fn run_us(&mut self, us: u64) {
        let end = self.cycle() + us * CYCLES_PER_US;
        while self.cycle() < end {
            self.step();
        }
    }

    /// Runs the chip for a quantum.
    ///
    /// # Panics
    /// If the emulator fails.
    pub fn step(&mut self) {
        let is_start = self.cycle() < START;
        self.emulator.step_quantum = if is_start { 1 } else { self.quantum };
        if is_start {
            let registers = &mut self.emulator.core_mut(0).regs;
            registers.msp = registers.r[13];
        }
        #[allow(clippy::expect_used, reason = "it fails with threads only")]
        self.emulator.step().expect("a step");
        self.emulator.bus.atomics.clear_wfe_waiting(0);
        if let Some(byte) = self.uart.step(&mut self.emulator)
            && let Some(Ok(message)) = self.accumulator.push(byte)
        {
            self.received.push(message);
        }
        let pio = &self.emulator.bus.pio[0];
        let levels = pio.local_to_physical_pins(pio.pad_out).0;
        self.pins.look(levels, self.emulator.cycles());
    }

    /// Sends bytes over the serial line, and runs the chip until it has received the last one.
    pub fn send(&mut self, bytes: &[u8]) {
        self.uart.send(bytes);
        while !self.uart.is_idle() {
            self.step();
        }
    }

    /// Returns the frame of a command with a new id, and the id.
    ///
    /// # Panics
    /// Never: all commands fit a frame.
    pub fn frame(&mut self, command: Command) -> (u16, Vec<u8>) {
        self.id += 1;
        #[allow(clippy::expect_used, reason = "all commands fit a frame")]
        let frame = encode(&ToBoard { id: self.id, command }).expect("a frame");
        (self.id, frame.to_vec())
    }

    /// Sets the line's speed: the cycles of a byte to the board. The board's bytes take no time.
    pub fn set_byte(&mut self, cycles: u64) {
        self.uart.set_byte(cycles);
    }

    /// Opens or closes the emergency loop.
    pub fn set_emergency(&mut self, is_open: bool) {
        let bit = 1 << PICO_2.pins.emergency.number;
        let levels = if is_open { bit } else { 0 };
        self.emulator.bus.gpio_external_in.store(levels, std::sync::atomic::Ordering::Relaxed);
    }
}

/// Returns a boot ROM with what the firmware reads of it: the version of the stepping A2, and a
/// lookup of functions that finds none (RP2350 datasheet, section 5.4.1).
fn boot_rom() -> Vec<u8> {
    const LOOKUP: usize = 0x100;
    let mut rom = vec![0; 0x8000];
    rom[0x13] = 2;
    rom[0x16..0x18].copy_from_slice(&(LOOKUP as u16 | 1).to_le_bytes());
    // movs r0, #0; bx lr
    rom[LOOKUP..LOOKUP + 4].copy_from_slice(&[0x00, 0x20, 0x70, 0x47]);
    rom
}
