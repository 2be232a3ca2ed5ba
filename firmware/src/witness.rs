//! Counts of the pulses at the STEP and DIR pins, for a self-test. PIO1 looks at the pins that PIO0
//! drives: it is a witness that shares nothing with the generator but the chip's clock.

use embassy_rp::pac;
use embassy_rp::pio::program::{
    InstructionOperands, JmpCondition, MovDestination, MovOperation, MovSource, pio_asm,
};
use plumb_core::TICK_US;
use plumb_protocol::boards::PICO;
use plumb_protocol::diagnostics::{ChipMeasurement, PulseCount};
use plumb_protocol::dimension::{MOTORS, MotorList};
use plumb_protocol::wiring::Wiring;

use crate::chip::TIMER;

/// State machines of motors A, B and C.
const MACHINES: u8 = (1 << MOTORS) - 1;
/// Most rounds of a wait for the answer of a state machine. One takes a few clocks.
const MAX_ROUNDS: u32 = TICK_US;

/// Returns a measurement. The first one begins to count at the pins of this wiring. The motors
/// stand.
#[cold]
pub(crate) fn measure(wiring: Option<&Wiring>) -> ChipMeasurement {
    if pac::PIO1.ctrl().read().sm_enable() == 0 {
        start(wiring);
    }
    let motors = wiring.map_or(PICO.pins.motors, |wiring| wiring.pins.motors);
    ChipMeasurement {
        pulses: MotorList::from_fn(motors.len(), count),
        time_us: TIMER.timerawl().read(),
        usb_frame: usb_frame(),
    }
}

/// Returns the number of the last frame of USB; `None` where no host sends frames.
fn usb_frame() -> Option<u16> {
    let status = pac::USB.sie_status().read();
    (status.connected() && !status.suspended()).then(|| pac::USB.sof_rd().read().count())
}

/// Ends the count: the next measurement begins another one.
#[cold]
pub(crate) fn stop() {
    pac::PIO1.ctrl().write(|_| {});
}

/// Starts the three state machines. Each counts down: x with DIR low, y with DIR high.
fn start(wiring: Option<&Wiring>) {
    let program = pio_asm!(
        ".origin 0",
        ".wrap_target",
        "low:",
        "    wait 0 pin 0",
        "    wait 1 pin 0", // a pulse
        "    jmp pin, high",
        "    jmp x--, low",
        "high:",
        "    jmp y--, low",
        ".wrap",
    );
    for (address, instruction) in program.program.code.iter().enumerate() {
        pac::PIO1.instr_mem(address).write(|w| w.set_instr_mem(*instruction));
    }
    let pins = wiring.map_or(&PICO.pins, |wiring| &wiring.pins);
    for (machine, motor) in pins.motors.iter().enumerate() {
        let registers = pac::PIO1.sm(machine);
        registers.clkdiv().write(|w| w.set_int(1));
        registers.pinctrl().write(|w| w.set_in_base(motor.step.number));
        registers.execctrl().write(|w| {
            w.set_jmp_pin(motor.direction.number);
            w.set_wrap_bottom(program.program.wrap.target);
            w.set_wrap_top(program.program.wrap.source);
        });
        let begin = InstructionOperands::JMP { condition: JmpCondition::Always, address: 0 };
        registers.instr().write(|w| w.set_instr(begin.encode()));
        // All ones: `jmp x--` of a counter at zero would not jump.
        for counter in [MovDestination::X, MovDestination::Y] {
            execute(machine, counter, MovOperation::Invert, MovSource::NULL);
        }
    }
    pac::PIO1.ctrl().modify(|w| w.set_sm_enable(MACHINES));
}

/// Returns the counts of a motor.
fn count(machine: usize) -> PulseCount {
    PulseCount { low: !counter(machine, MovSource::X), high: !counter(machine, MovSource::Y) }
}

/// Returns a counter of a state machine, which waits for a pulse.
fn counter(machine: usize, source: MovSource) -> u32 {
    execute(machine, MovDestination::ISR, MovOperation::None, source);
    let push = InstructionOperands::PUSH { if_full: false, block: false };
    pac::PIO1.sm(machine).instr().write(|w| w.set_instr(push.encode()));
    for _ in 0..MAX_ROUNDS {
        if pac::PIO1.fstat().read().rxempty() & (1 << machine) == 0 {
            break;
        }
    }
    pac::PIO1.rxf(machine).read()
}

/// Has a state machine copy at once.
fn execute(machine: usize, destination: MovDestination, op: MovOperation, source: MovSource) {
    let copy = InstructionOperands::MOV { destination, op, source };
    pac::PIO1.sm(machine).instr().write(|w| w.set_instr(copy.encode()));
}
