//! The programs of the state machines, and looking into them.

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
use plumb_core::driver_timing::PulseWidth;

/// Where the pulse's width is in the program.
const SET_WIDTH: usize = 12;
const LOOP_WIDTH: usize = 13;
/// `out y`: before it, the counter is still the last segment's.
const COUNTED: u8 = 2;
/// Where the watcher's program begins, behind the other.
const WATCHER: u8 = 17;

/// Loads the program that turns a segment's two words into pulses, at address 0.
pub(super) fn load_stepper(common: &mut Common<'static, PIO0>) -> LoadedProgram<'static, PIO0> {
    // Clocks and words as plumb_core::segment counts them; one clock an instruction. The numbers
    // are addresses.
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
        "    wait 0 irq 4       side 0", // 11  for ever, when the emergency input has opened
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

/// Starts the watch over the emergency input.
pub(super) fn start_watcher(
    common: &mut Common<'static, PIO0>,
    machine: &mut StateMachine<'static, PIO0, 3>,
    mut pin: Pin<'static, PIO0>,
) {
    let program = pio_asm!(
        ".origin 17",
        "    wait 1 pin 0", // open, so pulled up
        "    irq nowait 4",
        "done:",
        "    jmp done",
    );
    let loaded = common.load_program(&program.program);
    pin.set_pull(Pull::Up);
    let mut config = Config::default();
    config.use_program(&loaded, &[]);
    config.set_in_pins(&[&pin]);
    machine.set_config(&config);
    machine.set_pin_dirs(Direction::In, &[&pin]);
    machine.set_enable(true);
}

/// Makes pulses this wide from the next one on.
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

fn execute(machine: usize, instruction: InstructionOperands) {
    pac::PIO0.sm(machine).instr().write(|w| w.set_instr(instruction.encode()));
}

/// Puts a motor's state machine, which stands still, before its program with empty queues and STEP
/// low.
pub(super) fn rewind(machine: usize) {
    let pio = pac::PIO0;
    // Changing how the queues are joined empties them.
    for joined in [true, false] {
        pio.sm(machine).shiftctrl().modify(|w| w.set_fjoin_rx(joined));
    }
    pio.ctrl().modify(|w| w.set_sm_restart(1 << machine));
    execute(machine, InstructionOperands::JMP { condition: JmpCondition::Always, address: 0 });
}

/// Lets the watcher look at its pin again.
pub(super) fn rewind_watcher(machine: usize) {
    execute(
        machine,
        InstructionOperands::JMP { condition: JmpCondition::Always, address: WATCHER },
    );
}

/// Words that wait for the state machine.
pub(super) fn queued(machine: usize) -> u8 {
    let level = pac::PIO0.flevel().read();
    [level.tx0(), level.tx1(), level.tx2()][machine]
}

/// Whether a motor's state machine has done everything that it was given.
pub(super) fn idle(machine: usize) -> bool {
    pac::PIO0.sm(machine).addr().read().addr() == 0 && queued(machine) == 0
}

/// How far a state machine is.
pub(super) enum Progress {
    /// It waits for a segment.
    Between,
    /// It has taken the first word of a segment and done nothing yet.
    Beginning,
    /// It is under way in a segment, between pulses or after them.
    Within {
        /// Its counter: pulses after the coming one.
        remaining: u32,
    },
}

/// How far a motor's state machine is; it stands still, and its STEP is low.
pub(super) fn progress(machine: usize) -> Progress {
    match pac::PIO0.sm(machine).addr().read().addr() {
        0 => Progress::Between,
        address if address < COUNTED => Progress::Beginning,
        _ => Progress::Within { remaining: counter(machine) },
    }
}

/// The counter of a state machine that stands still.
fn counter(machine: usize) -> u32 {
    let (destination, op, source) = (MovDestination::ISR, MovOperation::None, MovSource::Y);
    execute(machine, InstructionOperands::MOV { destination, op, source });
    execute(machine, InstructionOperands::PUSH { if_full: false, block: false });
    pac::PIO0.rxf(machine).read()
}
