//! Programs of the state machines, and reading their state.

use embassy_rp::gpio::Pull;
use embassy_rp::pac;
use embassy_rp::peripherals::PIO0;
use embassy_rp::pio::program::{
    InstructionOperands, JmpCondition, MovDestination, MovOperation, MovSource, SetDestination,
    pio_asm,
};
use embassy_rp::pio::{
    Common, Config, Direction, LoadedProgram, Pin, ShiftConfig, ShiftDirection, StateMachine,
};
use plumb_core::timing::{CLOCKS_PER_US, PulseWidth};

use super::ESTOP_FILTER_US;

/// Address of `set x` for the pulse's width.
const SET_WIDTH: usize = 12;
/// Address of the loop for the pulse's width.
const LOOP_WIDTH: usize = 13;
/// Address after `out y`: before it, the counter is that of the last segment.
const COUNTED: u8 = 2;

/// Clocks from one sample of the open emergency input to the next.
const CLOCKS_PER_SAMPLE: u32 = 2;

/// Loads the program that turns a segment's two words into pulses, at address 0.
pub(super) fn load_stepper(common: &mut Common<'static, PIO0>) -> LoadedProgram<'static, PIO0> {
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
    common.load_program(&program.program)
}

/// Prepares a state machine to run the program on its STEP and DIR pins.
pub(super) fn set_up_stepper<const SM: usize>(
    machine: &mut StateMachine<'static, PIO0, SM>,
    program: &LoadedProgram<'static, PIO0>,
    (step, direction): &(Pin<'static, PIO0>, Pin<'static, PIO0>),
) {
    let mut config = Config::default();
    config.use_program(program, &[step]);
    config.set_out_pins(&[direction]);
    config.shift_out =
        ShiftConfig { threshold: 32, direction: ShiftDirection::Right, auto_fill: false };
    machine.set_config(&config);
    machine.set_pin_dirs(Direction::Out, &[step, direction]);
}

/// Starts the monitor of the emergency input, which then runs for ever. It may switch off `enable`.
pub(super) fn start_estop_monitor(
    common: &mut Common<'static, PIO0>,
    machine: &mut StateMachine<'static, PIO0, 3>,
    mut estop: Pin<'static, PIO0>,
    enable: &Pin<'static, PIO0>,
) {
    // On the chip `wait` and `jmp pin` see the input two clocks late (RP2040 datasheet, section
    // 3.7, INPUT_SYNC_BYPASS). tests/chip/test/monitor.mjs has a copy of this program.
    let program = pio_asm!(
        ".origin 17",
        "    pull block", // 17  samples of an opening after the first
        ".wrap_target",
        "closed:",
        "    wait 1 pin 0",  // 18  open, so pulled up
        "    mov x, osr",    // 19
        "sample:",           //     every two clocks
        "    jmp pin, open", // 20
        "    jmp closed",    // 21  closed again: too short
        "open:",
        "    jmp x--, sample", // 22
        "    set pindirs, 0",  // 23  lets go of ENABLE: the drivers are off
        "    irq wait 4",      // 24  sets the flag, and waits until the processor clears it
        "    set pindirs, 1",  // 25  ENABLE is the processor's again
        ".wrap",
    );
    let loaded = common.load_program(&program.program);
    estop.set_pull(Pull::Up);
    let mut config = Config::default();
    config.use_program(&loaded, &[]);
    config.set_in_pins(&[&estop]);
    config.set_jmp_pin(&estop);
    config.set_set_pins(&[enable]);
    machine.set_config(&config);
    machine.set_pin_dirs(Direction::In, &[&estop]);
    machine.set_pin_dirs(Direction::Out, &[enable]);
    machine.tx().push(ESTOP_FILTER_US * CLOCKS_PER_US / CLOCKS_PER_SAMPLE - 1);
    machine.set_enable(true);
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

/// Resets a motor's stopped state machine to the start of its program, with empty queues and STEP
/// low.
pub(super) fn rewind(machine: usize) {
    let pio = pac::PIO0;
    // Changing the join of the queues empties them.
    for joined in [true, false] {
        pio.sm(machine).shiftctrl().modify(|w| w.set_fjoin_rx(joined));
    }
    pio.ctrl().modify(|w| w.set_sm_restart(1 << machine));
    execute(machine, InstructionOperands::JMP { condition: JmpCondition::Always, address: 0 });
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
