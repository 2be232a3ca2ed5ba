//! The emulator's bus as the firmware needs it: a UART0 with a receiver, and the processor's
//! registers that the emulator lacks.

use std::collections::BTreeMap;
use std::sync::Arc;

use rp2350_emu::Bus;
use rp2350_emu::core::CoreBus;
use rp2350_emu::threaded::CoreAtomics;

use crate::uart::Uart;

/// Addresses of UART0; bits 12 and 13 of an address choose how a write changes the register (RP2350
/// datasheet, section 2.1.3).
const UART: u32 = 0x4007_0000;
const UART_MASK: u32 = 0xffff_c000;
/// TICKS: the clocks of each microsecond for the processors and for both timers. The emulator
/// counts those of the system, 150, for those of the crystal, 12.
const TICK_CYCLES: [u32; 4] = [0x4010_8004, 0x4010_8010, 0x4010_801c, 0x4010_8028];
/// The channels of the DMA, and offsets in one (RP2350 datasheet, section 12.6.10). In the emulator
/// a write to AL2_TRANS_COUNT also starts the channel, and a start does not reload the count.
const DMA: std::ops::Range<u32> = 0x5000_0000..0x5000_0400;
const TRANS_COUNT: u32 = 0x08;
const AL2_TRANS_COUNT: u32 = 0x24;
const AL3_READ_ADDR_TRIG: u32 = 0x3c;
/// STIR, which pends an interrupt by its number.
const STIR: u32 = 0xe000_ef00;
/// NVIC_ISPR0, and NVIC_IPR0 with a priority in each byte.
const PEND: u32 = 0xe000_e200;
const PRIORITIES: std::ops::Range<u32> = 0xe000_e400..0xe000_e434;

/// A write that the emulator drops.
#[derive(Clone, Copy)]
pub(crate) enum Dropped {
    /// An interrupt becomes pending.
    Pend(u32),
    /// The priority of an interrupt.
    Priority(u32, u8),
}

impl Dropped {
    /// Returns the write to a register of the processor that does the same; `read` reads one.
    pub(crate) fn word(self, mut read: impl FnMut(u32) -> u32) -> (u32, u32) {
        match self {
            Self::Pend(number) => (PEND + number / 32 * 4, 1 << (number % 32)),
            Self::Priority(number, priority) => {
                let register = PRIORITIES.start + number / 4 * 4;
                let place = number % 4 * 8;
                let others = read(register) & !(0xff << place);
                (register, others | u32::from(priority) << place)
            }
        }
    }
}

/// The bus.
pub(crate) struct RepairedBus<'a> {
    pub(crate) bus: &'a mut Bus,
    pub(crate) uart: &'a mut Uart,
    /// Transfers of each channel of the DMA, by its address.
    pub(crate) counts: &'a mut BTreeMap<u32, u32>,
    /// What the last instruction has written and the emulator has dropped.
    pub(crate) dropped: Option<Dropped>,
}

/// Returns the offset of a register of UART0; `None` for another address.
fn uart(address: u32) -> Option<u32> {
    (address & UART_MASK == UART).then_some(address & 0xffc)
}

impl RepairedBus<'_> {
    /// Writes a register that is not UART0's.
    fn write_other(&mut self, address: u32, value: u32, core: u8) {
        let channel = DMA.contains(&address).then_some(address & !0x3f);
        match (channel, address & 0x3f) {
            (Some(channel), AL2_TRANS_COUNT) => {
                self.counts.insert(channel, value);
                CoreBus::write32(self.bus, channel + TRANS_COUNT, value, core);
            }
            (Some(channel), AL3_READ_ADDR_TRIG) => {
                let count = self.counts.get(&channel).copied().unwrap_or(0);
                CoreBus::write32(self.bus, channel + TRANS_COUNT, count, core);
                CoreBus::write32(self.bus, address, value, core);
            }
            _ if TICK_CYCLES.contains(&address) => {
                CoreBus::write32(self.bus, address, value * 150 / 12, core);
            }
            _ => CoreBus::write32(self.bus, address, value, core),
        }
    }
}

impl CoreBus for RepairedBus<'_> {
    fn read8(&mut self, address: u32, core: u8) -> u8 {
        match uart(address) {
            Some(offset) => self.uart.read(offset) as u8,
            None => CoreBus::read8(self.bus, address, core),
        }
    }

    fn read16(&mut self, address: u32, core: u8) -> u16 {
        match uart(address) {
            Some(offset) => self.uart.read(offset) as u16,
            None => CoreBus::read16(self.bus, address, core),
        }
    }

    fn read32(&mut self, address: u32, core: u8) -> u32 {
        match uart(address) {
            Some(offset) => self.uart.read(offset),
            None => CoreBus::read32(self.bus, address, core),
        }
    }

    fn write8(&mut self, address: u32, value: u8, core: u8) {
        match uart(address) {
            Some(offset) => self.uart.write(offset, value.into()),
            None => CoreBus::write8(self.bus, address, value, core),
        }
    }

    fn write16(&mut self, address: u32, value: u16, core: u8) {
        match uart(address) {
            Some(offset) => self.uart.write(offset, value.into()),
            None => CoreBus::write16(self.bus, address, value, core),
        }
    }

    fn write32(&mut self, address: u32, value: u32, core: u8) {
        let Some(offset) = uart(address) else {
            return self.write_other(address, value, core);
        };
        let value = match address >> 12 & 3 {
            0 => value,
            1 => self.uart.read(offset) ^ value,
            2 => self.uart.read(offset) | value,
            _ => self.uart.read(offset) & !value,
        };
        self.uart.write(offset, value);
    }

    fn set_active_pc(&mut self, pc: u32, core: u8) {
        CoreBus::set_active_pc(self.bus, pc, core);
    }

    fn bus_fault(&self, core: u8) -> bool {
        CoreBus::bus_fault(self.bus, core)
    }

    fn bus_fault_addr(&self, core: u8) -> u32 {
        CoreBus::bus_fault_addr(self.bus, core)
    }

    fn clear_bus_fault(&mut self, core: u8) {
        CoreBus::clear_bus_fault(self.bus, core);
    }

    fn set_burst_mode(&mut self, on: bool) {
        CoreBus::set_burst_mode(self.bus, on);
    }

    fn add_extra_wait_states(&mut self, n: u32) {
        CoreBus::add_extra_wait_states(self.bus, n);
    }

    fn take_extra_wait_states(&mut self) -> u32 {
        CoreBus::take_extra_wait_states(self.bus)
    }

    fn atomics(&self) -> &Arc<CoreAtomics> {
        CoreBus::atomics(self.bus)
    }

    fn gpio_read_out(&self) -> u32 {
        CoreBus::gpio_read_out(self.bus)
    }

    fn gpio_write_out(&mut self, value: u32) {
        CoreBus::gpio_write_out(self.bus, value);
    }

    fn gpio_set_out(&mut self, mask: u32) {
        CoreBus::gpio_set_out(self.bus, mask);
    }

    fn gpio_clear_out(&mut self, mask: u32) {
        CoreBus::gpio_clear_out(self.bus, mask);
    }

    fn gpio_xor_out(&mut self, mask: u32) {
        CoreBus::gpio_xor_out(self.bus, mask);
    }

    fn gpio_read_oe(&self) -> u32 {
        CoreBus::gpio_read_oe(self.bus)
    }

    fn gpio_write_oe(&mut self, value: u32) {
        CoreBus::gpio_write_oe(self.bus, value);
    }

    fn gpio_set_oe(&mut self, mask: u32) {
        CoreBus::gpio_set_oe(self.bus, mask);
    }

    fn gpio_clear_oe(&mut self, mask: u32) {
        CoreBus::gpio_clear_oe(self.bus, mask);
    }

    fn gpio_xor_oe(&mut self, mask: u32) {
        CoreBus::gpio_xor_oe(self.bus, mask);
    }

    fn gpio_read_in(&self) -> u32 {
        CoreBus::gpio_read_in(self.bus)
    }

    fn extra_wait_states(&self) -> u32 {
        CoreBus::extra_wait_states(self.bus)
    }

    fn reset_extra_wait_states(&mut self) {
        CoreBus::reset_extra_wait_states(self.bus);
    }

    fn last_fetch_addr(&self) -> u32 {
        CoreBus::last_fetch_addr(self.bus)
    }

    fn set_last_fetch_addr(&mut self, address: u32) {
        CoreBus::set_last_fetch_addr(self.bus, address);
    }

    fn mmio_trace_enabled(&self) -> bool {
        true
    }

    /// Sees every access to the processor's own registers, also those that are dropped.
    fn emit_mmio_trace(&mut self, kind: char, size: u32, address: u32, value: u32, _: u8) {
        match (kind, size) {
            ('W', 4) if address == STIR => self.dropped = Some(Dropped::Pend(value)),
            ('W', 1) if PRIORITIES.contains(&address) => {
                let number = address - PRIORITIES.start;
                self.dropped = Some(Dropped::Priority(number, value as u8));
            }
            _ => {}
        }
    }
}
