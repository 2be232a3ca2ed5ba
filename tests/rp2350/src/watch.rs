//! Clocks of a function and of the stepping interrupt, instruction by instruction.

use rp2350_emu::core::Registers;

/// Exception number of TIMER0_IRQ_1, the stepping interrupt. It has the highest priority, so that
/// its time contains no other handler.
const STEPPING: u32 = 17;

/// Clocks of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// From its first instruction to its return, with everything that interrupts it.
    pub total: u64,
    /// The same without what interrupts it.
    pub own: u64,
}

/// A call that has not returned.
#[derive(Debug, Clone, Copy)]
struct Running {
    began: u64,
    /// Where it returns to, and the stack pointer there.
    back: [u32; 2],
    /// Exception that it runs in.
    exception: u32,
    /// Clocks of what has interrupted it.
    others: u64,
}

/// Clocks so far.
#[derive(Debug, Clone, Default)]
pub struct Watch {
    /// Address of the function; 0 for none.
    function: u32,
    /// Its calls that have returned.
    pub calls: Vec<Call>,
    /// The stepping interrupts that have returned, clocks.
    pub ticks: Vec<u64>,
    running: Option<Running>,
    tick: Option<u64>,
    last: u64,
}

impl Watch {
    /// Creates a watch of the function at this address.
    pub fn new(function: u32) -> Self {
        Self { function, ..Self::default() }
    }

    /// Looks at the processor before an instruction; `clock` counts those that it has run.
    pub(crate) fn look(&mut self, clock: u64, registers: &Registers) {
        let exception = registers.xpsr & 0x1ff;
        match self.tick {
            None if exception == STEPPING => self.tick = Some(clock),
            Some(began) if exception != STEPPING => {
                self.ticks.push(clock - began);
                self.tick = None;
            }
            _ => {}
        }
        let (pc, stack) = (registers.pc(), registers.r[13]);
        match &mut self.running {
            None if pc == self.function => {
                let back = [registers.r[14] & !1, stack];
                self.running = Some(Running { began: clock, back, exception, others: 0 });
            }
            None => {}
            Some(running) if exception != running.exception => running.others += clock - self.last,
            Some(running) if running.back == [pc, stack] => {
                let total = clock - running.began;
                self.calls.push(Call { total, own: total - running.others });
                self.running = None;
            }
            Some(_) => {}
        }
        self.last = clock;
    }
}
