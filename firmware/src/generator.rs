//! Step generation in hardware: three state machines of PIO0 run one program. A DMA channel gives
//! each of them two words a tick. A fourth state machine monitors the emergency input.
//!
//! All three begin in the same clock and take exactly a tick for a tick's words
//! ([`plumb_core::segment`]), so they stay in step. When the emergency input opens, the fourth
//! state machine lets go of the ENABLE lines, and sets a flag in the PIO that the others check
//! before each pulse: no further pulse begins, whatever the processor does. It is never started
//! again: it waits until the processor clears the flag, and then looks at the input again. An
//! opening shorter than [`program::ESTOP_FILTER_US`] has no effect. An input that is open in two
//! ticks in a row sets the flag too, whatever the state machine does.

mod program;

use core::array;
use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::pac::dma::vals::TreqSel;
use embassy_rp::peripherals::{DMA_CH0, DMA_CH1, DMA_CH2, PIO0};
use embassy_rp::pio::Pio;
use embassy_rp::{Peri, pac};
use plumb_core::segment::{Segments, given};
use plumb_core::timing::DriverTiming;
use plumb_core::{Pulses, StepPlan, TICK_US};
use plumb_protocol::dimension::{MOTORS, PerMotor};
use plumb_protocol::wiring::{MotorPins, Pin, Pins};

use crate::chip::timer;
use crate::interrupts::Interrupts;

/// The state machines of the motors.
const MACHINES: u8 = (1 << MOTORS) - 1;
/// Deviation of a tick that shows another clock, µs: more than the timer's resolution and the look
/// at three state machines. Clocks that the chip can be set to differ by 4 % and more from the
/// planned one.
const TOLERANCE_US: u32 = 4;
/// Pins of a motor that the rig has not. The chip has no pads for them, and the state machine runs
/// as the others do.
const NOWHERE: MotorPins = MotorPins { step: Pin::new(31), direction: Pin::new(30) };
/// The flag that the monitor of the emergency input sets.
const ESTOP_FLAG: u8 = 1 << 4;

/// Words of the coming tick, which the DMA channels read.
static WORDS: PerMotor<[AtomicU32; 2]> = [const { [const { AtomicU32::new(0) }; 2] }; MOTORS];

/// Channels of motors A, B and C.
type Channels = (Peri<'static, DMA_CH0>, Peri<'static, DMA_CH1>, Peri<'static, DMA_CH2>);

/// The step generator.
pub(crate) struct Generator {
    _pio: Pio<'static, PIO0>,
    _channels: Channels,
    motors: PerMotor<Motor>,
    /// The emergency input, as a bit; 0 without a configuration.
    estop: u32,
    /// The STEP pins, as bits.
    steps: u32,
    /// Whether the emergency input was open in the last tick.
    estop_was_open: bool,
}

/// State machine of one motor.
struct Motor {
    segments: Segments,
    /// Pulses of the last two ticks, the older first, + where the direction line is high.
    given: [i32; 2],
}

impl Motor {
    /// Gives the state machine its words for the next tick.
    #[inline(always)]
    fn give(&mut self, motor: usize, pulses: &Pulses) {
        let count = i32::from(pulses.count);
        self.given = [self.given[1], if pulses.direction { count } else { -count }];
        let (first, second) = self.segments.next(pulses);
        WORDS[motor][0].store(first, Ordering::Relaxed);
        WORDS[motor][1].store(second, Ordering::Release);
        pac::DMA.ch(motor).al3_read_addr_trig().write_value(WORDS[motor].as_ptr() as u32);
    }
}

impl Generator {
    /// Sets up the hardware, without pins.
    pub(crate) fn new(pio: Peri<'static, PIO0>, channels: Channels) -> Self {
        let mut pio = Pio::new(pio, Interrupts);
        program::load(&mut pio.common);
        (0..MOTORS).for_each(set_up_channel);
        program::set_width(DriverTiming::SLOWEST.high);
        Self {
            _pio: pio,
            _channels: channels,
            motors: [0; MOTORS]
                .map(|_| Motor { segments: Segments::new(DriverTiming::SLOWEST), given: [0; 2] }),
            estop: 0,
            steps: 0,
            estop_was_open: false,
        }
    }

    /// Changes to these pins, and starts the monitor of their emergency input; at standstill, with
    /// the state machines halted. An input that is open stops the pulses at once.
    #[cold]
    pub(crate) fn connect(&mut self, pins: &Pins) {
        for machine in 0..MOTORS {
            program::set_stepper_pins(machine, pins.motors.get(machine).unwrap_or(&NOWHERE));
        }
        // With coils the numbers of the STEP pins are not checked.
        let bit = |number: u8| 1 << (number & 31);
        self.steps = pins.motors.iter().fold(0, |mask, motor| mask | bit(motor.step.number));
        self.estop = bit(pins.emergency.number);
        self.estop_was_open = false;
        program::start_estop_monitor(pins.emergency.number);
        if !self.estop_closed() {
            force_estop();
        }
    }

    /// Changes to other drivers; at standstill.
    pub(crate) fn set_timing(&mut self, timing: DriverTiming) {
        program::set_width(timing.high);
        self.motors.iter_mut().for_each(|motor| motor.segments.set_timing(timing));
    }

    /// Gives the state machines their words for the next tick.
    pub(crate) fn give(&mut self, plan: &StepPlan) {
        let ([a, b, c], [of_a, of_b, of_c]) = (&mut self.motors, &plan.motors);
        a.give(0, of_a);
        b.give(1, of_b);
        c.give(2, of_c);
    }

    /// Waits until the state machines have finished, for two ticks at most. One that has not by
    /// then stands still: [`halt`](Self::halt) drops what is left of its words.
    pub(crate) fn finish(&mut self) {
        let begin = timer();
        while !(0..MOTORS).all(program::idle)
            && !self.estop_tripped()
            && timer().wrapping_sub(begin) < 2 * TICK_US
        {}
    }

    /// Returns whether a state machine has run out of words since the last call, which delays its
    /// pulses: a tick came late. [`finish`](Self::finish) waits for that, too.
    #[inline(always)]
    pub(crate) fn ran_dry(&mut self) -> bool {
        let flags = pac::PIO0.fdebug();
        let dry = flags.read().txstall() & MACHINES;
        if dry != 0 {
            flags.write(|w| w.set_txstall(dry));
        }
        dry != 0
    }

    /// Returns whether a tick of the state machines takes as long as one of the timer: the chip's
    /// clock is the one that the board plans with. At the start, without pins.
    #[cold]
    pub(crate) fn has_planned_clock(&mut self) -> bool {
        self.halt();
        self.give(&StepPlan::default());
        let begin = timer();
        self.run();
        self.finish();
        timer().wrapping_sub(begin).abs_diff(TICK_US) <= TOLERANCE_US
    }

    /// Stops the state machines before their first instruction, with empty queues.
    /// [`run`](Self::run) starts them.
    pub(crate) fn halt(&mut self) {
        let pio = pac::PIO0;
        pio.ctrl().modify(|w| w.set_sm_enable(w.sm_enable() & !MACHINES));
        for motor in 0..MOTORS {
            program::rewind(motor);
        }
        self.motors.iter_mut().for_each(|motor| motor.segments.restart());
    }

    /// Starts all three in the same clock.
    pub(crate) fn run(&mut self) {
        pac::PIO0.ctrl().modify(|w| {
            w.set_sm_enable(w.sm_enable() | MACHINES);
            w.set_clkdiv_restart(MACHINES);
        });
    }

    /// Checks the emergency input, once a tick. Returns whether it has stopped the pulses.
    #[inline(always)]
    pub(crate) fn check_estop(&mut self) -> bool {
        let open = !self.estop_closed();
        if open && self.estop_was_open {
            force_estop();
        }
        self.estop_was_open = open;
        self.estop_tripped()
    }

    /// Returns whether the emergency input has stopped the pulses.
    pub(crate) fn estop_tripped(&self) -> bool {
        pac::PIO0.irq().read().irq() & ESTOP_FLAG != 0
    }

    /// Returns whether the emergency input is closed now.
    pub(crate) fn estop_closed(&self) -> bool {
        pac::SIO.gpio_in(0).read() & self.estop == 0
    }

    /// Stops the state machines after the emergency input has opened. Returns the pulses of each
    /// motor that were planned and not given, + where the direction line is high.
    pub(crate) fn stop(&mut self) -> PerMotor<i32> {
        let pio = pac::PIO0;
        // A pulse under way ends within 513 clocks; no other begins.
        for _ in 0..513 {
            if pio.dbg_padout().read() & self.steps == 0 {
                break;
            }
        }
        pio.ctrl().modify(|w| w.set_sm_enable(w.sm_enable() & !MACHINES));
        let missing = array::from_fn(|motor| self.missing(motor));
        self.motors.iter_mut().for_each(|motor| motor.given = [0; 2]);
        missing
    }

    /// Ends the stop of the emergency input; the monitor goes on.
    pub(crate) fn end_estop(&mut self) {
        pac::PIO0.irq().write(|w| w.set_irq(ESTOP_FLAG));
    }

    /// Returns the missing pulses of a motor for [`stop`](Self::stop); its state machine is
    /// stopped.
    fn missing(&self, motor: usize) -> i32 {
        let [before, last] = self.motors[motor].given;
        // A segment's two words leave the queue as its program begins.
        let (begun, waiting) = match program::queued(motor) {
            0 | 1 => (last, 0),
            _ => (before, last),
        };
        let count = begun.unsigned_abs() as u16;
        let done = match program::progress(motor) {
            program::SegmentProgress::Between => count,
            program::SegmentProgress::Beginning => 0,
            program::SegmentProgress::Within { remaining } => given(count, remaining),
        };
        begun.signum() * i32::from(count - done) + waiting
    }
}

/// Stops the pulses as the monitor of the emergency input does, save for ENABLE.
fn force_estop() {
    pac::PIO0.irq_force().write(|w| w.set_irq_force(ESTOP_FLAG));
}

/// Sets up a channel: each trigger copies two words to the state machine, as it has room.
fn set_up_channel(motor: usize) {
    let channel = pac::DMA.ch(motor);
    channel.write_addr().write_value(pac::PIO0.txf(motor).as_ptr() as u32);
    channel.al2_trans_count().write_value(2);
    // Written through the alias that does not start the channel.
    let mut control = pac::dma::regs::CtrlTrig(0);
    control.set_en(true);
    control.set_high_priority(true);
    control.set_data_size(pac::dma::vals::DataSize::SIZE_WORD);
    control.set_incr_read(true);
    control.set_chain_to(motor as u8);
    control.set_treq_sel(TreqSel::from_bits(motor as u8));
    channel.al1_ctrl().write_value(control.0);
}
