//! The chip with the firmware in it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};

use plumb_protocol::boards::PICO_2;
use plumb_protocol::frame::{Accumulator, encode};
use plumb_protocol::message::{Command, FromBoard, ToBoard};
use rp2350_emu::{Config, Emulator};

use crate::bus::RepairedBus;
use crate::image::Firmware;
use crate::pins::Counter;
use crate::uart::Uart;
use crate::watch::Watch;

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
/// LSPEN of FPCCR: registers of the FPU are saved at their first use in a handler.
const LAZY: u32 = 1 << 30;
/// SCRATCH0 of the watchdog.
const SCRATCH: u32 = 0x400d_800c;
/// Number of UART0's interrupt.
const UART0: u32 = 33;
/// Cycles of a byte at 115 200 baud with its two frame bits.
const BYTE: u64 = 10 * 150_000_000 / 115_200;
/// Most cycles that pass at once.
pub const QUANTUM: u32 = 64;

/// A running chip of a Pico 2 with a closed emergency loop.
pub struct Chip {
    emulator: Emulator,
    uart: Uart,
    /// Transfers of each channel of the DMA.
    counts: BTreeMap<u32, u32>,
    accumulator: Accumulator,
    /// The clocks of the processor, while they are counted.
    pub watch: Option<Watch>,
    /// Cycles by which the processor is ahead of everything else.
    ahead: u64,
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
    /// Powers the chip on, and runs it until its serial line is open: 20 ms.
    ///
    /// # Panics
    /// If the firmware is shorter than its first two vectors.
    pub fn start(firmware: &Firmware) -> Self {
        let mut chip = Self::power_on(firmware);
        chip.run_us(20_000);
        chip
    }

    /// Powers the chip on.
    ///
    /// # Panics
    /// If the firmware is shorter than its first two vectors.
    pub fn power_on(firmware: &Firmware) -> Self {
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
        Self {
            emulator,
            uart: Uart::new(BYTE),
            counts: BTreeMap::new(),
            accumulator: Accumulator::new(),
            watch: None,
            ahead: 0,
            quantum: QUANTUM,
            pins: Counter::new(&PICO_2.pins),
            received: Vec::new(),
            id: 0,
        }
    }

    /// Returns the cycles since power-on.
    pub fn cycle(&self) -> u64 {
        self.emulator.cycles()
    }

    /// Returns what the program has left in the watchdog's scratch registers 0 to 3 for its next
    /// start (firmware/src/restart.rs): after a panic its place, after a fault PC and LR.
    pub fn scratch(&mut self) -> [u32; 4] {
        std::array::from_fn(|i| self.emulator.mmio_read32(SCRATCH + 4 * i as u32))
    }

    /// Runs the chip for `us` µs.
    pub fn run_us(&mut self, us: u64) {
        let end = self.cycle() + us * CYCLES_PER_US;
        while self.cycle() < end {
            self.step();
        }
    }

    /// Runs the chip for a quantum: the processor first, then everything else.
    ///
    /// # Panics
    /// If the emulator fails.
    pub fn step(&mut self) {
        self.run_processor();
        // The emulator finds both processors halted.
        self.emulator.bus.atomics.set_halted(0);
        self.emulator.step_quantum = self.quantum;
        #[allow(clippy::expect_used, reason = "it fails with threads only")]
        let cycle = self.emulator.step().expect("a step");
        self.emulator.bus.atomics.clear_halted(0);
        if self.uart.run(cycle) {
            self.emulator.bus.atomics.assert_irq_shared(UART0);
        }
        for byte in self.uart.sent.drain(..) {
            if let Some(Ok(message)) = self.accumulator.push(byte) {
                self.received.push(message);
            }
        }
        let pio = &self.emulator.bus.pio[0];
        self.pins.look(pio.local_to_physical_pins(pio.pad_out).0, cycle);
    }

    /// Runs the processor for a quantum, unless it sleeps.
    fn run_processor(&mut self) {
        let Emulator { cores, bus, .. } = &mut self.emulator;
        let core = &mut cores.expect_arm_mut()[0];
        let atomics = bus.atomics.clone();
        // The emulator pends an interrupt anew while its handler runs, until that has cleared the
        // cause: the handler would run twice.
        atomics.irq_pending[0].fetch_and(!mask(&core.ppb.nvic_iabr), Ordering::Relaxed);
        let pended = atomics.irq_pending_load(0) | mask(&core.ppb.nvic_ispr);
        if core.ppb.any_pending_enabled(pended) || atomics.event_flag_consume(0) {
            atomics.clear_wfe_waiting(0);
        }
        if atomics.is_wfe_waiting(0) {
            self.ahead = 0;
            return;
        }
        let quantum = u64::from(self.quantum);
        if self.ahead >= quantum {
            self.ahead -= quantum;
            return;
        }
        let mut bus =
            RepairedBus { bus, uart: &mut self.uart, counts: &mut self.counts, dropped: None };
        let end = core.cycles() + quantum - self.ahead;
        while core.cycles() < end && !atomics.is_wfe_waiting(0) {
            core.ppb.update_latest_cycles(core.cycles());
            core.regs.msp = core.regs.r[13];
            core.ppb.fpccr &= !LAZY;
            if let Some(watch) = &mut self.watch {
                watch.look(core.cycles(), &core.regs);
            }
            core.step(&mut bus);
            if let Some(dropped) = bus.dropped.take() {
                let (register, value) = dropped.word(|register| core.ppb.read32(register));
                core.ppb.write32(register, value);
            }
            if !bus.bus.pending_cache_invalidations.is_empty() {
                core.invalidate_decode_cache_entries(&bus.bus.pending_cache_invalidations);
                bus.bus.pending_cache_invalidations.clear();
            }
        }
        self.ahead = core.cycles().saturating_sub(end);
    }

    /// Sends bytes over the serial line, and runs the chip until it has received the last one.
    ///
    /// # Panics
    /// If the firmware does not take them within a second: it has stopped.
    pub fn send(&mut self, bytes: &[u8]) {
        self.uart.send(bytes);
        let end = self.cycle() + 1_000_000 * CYCLES_PER_US;
        while !self.uart.is_idle() {
            assert!(self.cycle() < end, "it takes no bytes; it has left {:x?}", self.scratch());
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

    /// Sets the line's speed: the cycles of a byte.
    pub fn set_byte(&mut self, cycles: u64) {
        self.uart.set_byte(cycles);
    }

    /// Returns the cycle at which the firmware's UART has received the last byte.
    pub fn last_byte(&self) -> u64 {
        self.uart.last_byte()
    }

    /// Opens or closes the emergency loop.
    pub fn set_emergency(&mut self, is_open: bool) {
        let bit = 1 << PICO_2.pins.emergency.number;
        let levels = if is_open { bit } else { 0 };
        self.emulator.bus.gpio_external_in.store(levels, Ordering::Relaxed);
    }
}

/// Returns the interrupts of two registers of the NVIC, a bit each.
fn mask(words: &[AtomicU32; 2]) -> u64 {
    let [low, high] = words.each_ref().map(|word| u64::from(word.load(Ordering::Relaxed)));
    high << 32 | low
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
