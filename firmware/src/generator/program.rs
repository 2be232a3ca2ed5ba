//! Programs of the state machines, and reading their state.

use embassy_rp::pac;
use embassy_rp::peripherals::PIO0;
use embassy_rp::pio::Common;
use embassy_rp::pio::program::{
    InstructionOperands, JmpCondition, MovDestination, MovOperation, MovSource, OutDestination,
    SetDestination, pio_asm,
};
use plumb_core::timing::{CLOCKS_PER_US, PulseWidth};
use plumb_protocol::dimension::MOTORS;
use plumb_protocol::wiring::MotorPins;

/// Time that the emergency input must be open to stop the pulses, µs. It is longer than a period of
/// the coils' modulation (33 µs), so that noise from the motors' leads closes the input in between.
pub(super) const ESTOP_FILTER_US: u32 = 50;
/// Address of `set x` for the pulse's width.
const SET_WIDTH: usize = 12;
/// Address of the loop for the pulse's width.
const LOOP_WIDTH: usize = 13;
/// Address after `out y`: before it, the counter is that of the last segment.
const COUNTED: u8 = 2;

/// State machine of the monitor of the emergency input.
const MONITOR: usize = MOTORS;
/// Address of the monitor's program.
const MONITOR_ORIGIN: u8 = 17;

/// Clocks from one sample of the open emergency input to the next.
const CLOCKS_PER_SAMPLE: u32 = 2;

/// Loads the programs, and prepares the state machines to run them. None of them has pins.
pub(super) fn load(common: &mut Common<'static, PIO0>) {
    let wrap = load_stepper(common);
    (0..MOTORS).for_each(|machine| set_up(machine, wrap));
    set_up(MONITOR, load_monitor(common));
}

/// First and last address of the part of a program that repeats.
#[derive(Clone, Copy)]
struct Wrap {
    bottom: u8,
    top: u8,
}

/// Prepares a state machine: the chip's clock, 32 bits a word, the lowest first.
fn set_up(machine: usize, wrap: Wrap) {
    let registers = pac::PIO0.sm(machine);
    registers.clkdiv().write(|w| w.set_int(1));
    registers.execctrl().write(|w| {
        w.set_wrap_bottom(wrap.bottom);
        w.set_wrap_top(wrap.top);
    });
    registers.shiftctrl().write(|w| w.set_out_shiftdir(true));
}

/// Loads the program that turns a segment's two words into pulses, at address 0.
fn load_stepper(common: &mut Common<'static, PIO0>) -> Wrap {
    // plumb_core::segment counts its clocks and packs its words. An instruction takes one clock.
    // The numbers are addresses.
    let program = pio_asm!(
        ".origin 0",
        ".side_set 1", // STEP
        ".wrap_target",
        "    pull block         side 0", //  0  first word; waits here when there is none
        "    out y, 10          side 0", //  1  pulses after the first
        "    out isr, 16        side 0", //  2  rounds between pulses
        "    out pins, 1        side 0", //  3  DIR
        "    out x, 1           side 0", //  4  any pulses?
        "    pull block         side 0", //  5  second word
        "    jmp !x, tail       side 0", //  6
        "    out x, 16          side 0", //  7  rounds to the first pulse
        "    jmp delay          side 0", //  8
        "more:",
        "    mov x, isr         side 0", //  9
        "delay:",
        "    jmp x--, delay     side 0", // 10
        "    wait 0 irq 4       side 0", // 11  flag 4: the emergency input has opened
        "    set x, 31          side 1", // 12  the pulse; see set_width
        "high:",
        "    jmp x--, high      side 1", // 13
        "    jmp y--, more      side 0", // 14
        "tail:",
        "    out x, 16          side 0", // 15  rounds to the end
        "rest:",
        "    jmp x--, rest      side 0", // 16
        ".wrap",
    );
    let loaded = common.load_program(&program.program);
    Wrap { bottom: loaded.wrap.target, top: loaded.wrap.source }
}

/// Connects a motor's stopped state machine to its STEP and DIR pins.
pub(super) fn set_stepper_pins(machine: usize, pins: &MotorPins) {
    pac::PIO0.sm(machine).pinctrl().write(|w| {
        w.set_sideset_base(pins.step.number & 31);
        w.set_sideset_count(1);
        w.set_out_base(pins.direction.number & 31);
        w.set_out_count(1);
    });
}

/// Loads the monitor of the emergency input.
fn load_monitor(common: &mut Common<'static, PIO0>) -> Wrap {
    // On the chip `wait` and `jmp pin` see the input two clocks late (RP2040 datasheet, section
    // 3.7, INPUT_SYNC_BYPASS). `out pindirs` changes the direction of all pins at once: those of
    // ENABLE have it from PIO0 and need not be neighbours, and those of STEP and DIR override it.
    // tests/chip/test/monitor.mjs has a copy of this program.
    let program = pio_asm!(
        ".origin 17",
        "    pull block", // 17  samples of an opening after the first
        "    mov y, osr", // 18
        ".wrap_target",
        "    mov osr, null", // 19  the directions of an emergency
        "closed:",
        "    wait 1 pin 0",  // 20  open, so pulled up
        "    mov x, y",      // 21
        "sample:",           //     every two clocks
        "    jmp pin, open", // 22
        "    jmp closed",    // 23  closed again: too short
        "open:",
        "    jmp x--, sample", // 24
        "    out pindirs, 32", // 25  lets go of ENABLE: the drivers are off
        "    irq wait 4",      // 26  sets the flag, and waits until the processor clears it
        "    mov osr, ~null",  // 27
        "    out pindirs, 32", // 28  ENABLE is the processor's again
        ".wrap",
    );
    let loaded = common.load_program(&program.program);
    Wrap { bottom: loaded.wrap.target, top: loaded.wrap.source }
}

/// Starts the monitor with its input at this pin. It then runs until it is started again.
#[cold]
pub(super) fn start_estop_monitor(input: u8) {
    let pio = pac::PIO0;
    pio.ctrl().modify(|w| w.set_sm_enable(w.sm_enable() & !(1 << MONITOR)));
    let registers = pio.sm(MONITOR);
    registers.pinctrl().write(|w| {
        w.set_in_base(input & 31);
        // All pins.
        w.set_out_base(0);
        w.set_out_count(32);
    });
    registers.execctrl().modify(|w| w.set_jmp_pin(input & 31));
    rewind(MONITOR);
    let (destination, op, source) = (MovDestination::OSR, MovOperation::Invert, MovSource::NULL);
    execute(MONITOR, InstructionOperands::MOV { destination, op, source });
    execute(
        MONITOR,
        InstructionOperands::OUT { destination: OutDestination::PINDIRS, bit_count: 32 },
    );
    jump(MONITOR, MONITOR_ORIGIN);
    pio.txf(MONITOR).write_value(ESTOP_FILTER_US * CLOCKS_PER_US / CLOCKS_PER_SAMPLE - 1);
    pio.ctrl().modify(|w| w.set_sm_enable(w.sm_enable() | 1 << MONITOR));
}

/// Sets the width of the pulses, from the next one on.
pub(super) fn set_width(width: PulseWidth) {
    const STEP_HIGH: u16 = 1 << 12;
    let set =
        InstructionOperands::SET { destination: SetDestination::X, data: width.rounds }.encode();
    let jump = InstructionOperands::JMP {
        condition: JmpCondition::XDecNonZero,
        address: LOOP_WIDTH as u8,
    }
    .encode();
    let write = |at: usize, instruction: u16| {
        pac::PIO0.instr_mem(at).write(|w| w.set_instr_mem(instruction))
    };
    write(SET_WIDTH, set | STEP_HIGH);
    write(LOOP_WIDTH, jump | STEP_HIGH | u16::from(width.delay) << 8);
}

/// Executes an instruction at once.
fn execute(machine: usize, instruction: InstructionOperands) {
    pac::PIO0.sm(machine).instr().write(|w| w.set_instr(instruction.encode()));
}

/// Resets a stopped state machine to address 0, where a motor's program starts, with empty queues
/// and STEP low.
pub(super) fn rewind(machine: usize) {
    let pio = pac::PIO0;
    // Changing the join of the queues empties them.
    for joined in [true, false] {
        pio.sm(machine).shiftctrl().modify(|w| w.set_fjoin_rx(joined));
    }
    pio.ctrl().modify(|w| w.set_sm_restart(1 << machine));
    jump(machine, 0);
}

/// Has a stopped state machine go on at an address.
fn jump(machine: usize, address: u8) {
    execute(machine, InstructionOperands::JMP { condition: JmpCondition::Always, address });
}

/// Returns the words in the queue of a motor's state machine.
pub(super) fn queued(machine: usize) -> u8 {
    let level = pac::PIO0.flevel().read();
    [level.tx0(), level.tx1(), level.tx2()][machine]
}

/// Returns whether a motor's state machine has finished all its words.
pub(super) fn idle(machine: usize) -> bool {
    pac::PIO0.sm(machine).addr().read().addr() == 0 && queued(machine) == 0
}

/// Progress of a state machine in its segment.
pub(super) enum SegmentProgress {
    /// It waits for a segment.
    Between,
    /// It has taken the first word of a segment, and no pulse was given yet.
    Beginning,
    /// It is in a segment, between pulses or after them.
    Within {
        /// Its counter: pulses after the next one.
        remaining: u32,
    },
}

/// Returns the progress of a motor's stopped state machine with STEP low.
pub(super) fn progress(machine: usize) -> SegmentProgress {
    match pac::PIO0.sm(machine).addr().read().addr() {
        0 => SegmentProgress::Between,
        address if address < COUNTED => SegmentProgress::Beginning,
        _ => SegmentProgress::Within { remaining: counter(machine) },
    }
}

/// Returns the counter of a stopped state machine.
fn counter(machine: usize) -> u32 {
    let (destination, op, source) = (MovDestination::ISR, MovOperation::None, MovSource::Y);
    execute(machine, InstructionOperands::MOV { destination, op, source });
    execute(machine, InstructionOperands::PUSH { if_full: false, block: false });
    pac::PIO0.rxf(machine).read()
}
