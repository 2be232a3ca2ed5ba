//! Steps in hardware: three state machines of PIO0 run one program, each fed with two words a tick
//! by its DMA channel; a fourth watches the emergency input.
//!
//! All three begin in the same clock and take exactly a tick for a tick's words
//! ([`plumb_core::segment`]), so they stay together without any further doing. The emergency input
//! raises a flag in the PIO that each machine looks at before each pulse: when it opens, no further
//! pulse begins, whatever the processor is doing.

mod program;

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_rp::Peri;
use embassy_rp::pac::{self, dma::vals::TreqSel};
use embassy_rp::peripherals::{
    DMA_CH0, DMA_CH1, DMA_CH2, PIN_2, PIN_3, PIN_4, PIN_5, PIN_6, PIN_7, PIN_15, PIO0,
};
use embassy_rp::pio::{Common, Pio};
use plumb_core::driver_timing::DriverTiming;
use plumb_core::segment::{Segments, given};
use plumb_core::{Pulses, StepPlan};

use crate::{Interrupts, pins};

/// The state machines of the motors.
const MOTORS: u8 = 0b0111;
/// The one that watches the emergency input.
const WATCHER: usize = 3;
/// The flag that it raises.
const CUT: u8 = 1 << 4;
/// The STEP pins.
const STEP_PINS: u32 = 1 << pins::STEP[0] | 1 << pins::STEP[1] | 1 << pins::STEP[2];

/// What the DMA channels read: the words of the coming tick.
static WORDS: [[AtomicU32; 2]; 3] = [const { [const { AtomicU32::new(0) }; 2] }; 3];

/// What the generator takes of the chip. Motor A has the first of each, B the second, C the third.
pub(crate) struct Parts {
    pub(crate) pio: Peri<'static, PIO0>,
    pub(crate) step: (Peri<'static, PIN_2>, Peri<'static, PIN_4>, Peri<'static, PIN_6>),
    pub(crate) direction: (Peri<'static, PIN_3>, Peri<'static, PIN_5>, Peri<'static, PIN_7>),
    pub(crate) emergency: Peri<'static, PIN_15>,
    pub(crate) channels: (Peri<'static, DMA_CH0>, Peri<'static, DMA_CH1>, Peri<'static, DMA_CH2>),
}

/// The step generator.
pub(crate) struct Generator {
    /// Kept, since the pins are given back when it goes.
    _pio: Pio<'static, PIO0>,
    _channels: (Peri<'static, DMA_CH0>, Peri<'static, DMA_CH1>, Peri<'static, DMA_CH2>),
    motors: [Motor; 3],
}

/// One motor's state machine.
struct Motor {
    segments: Segments,
    /// The pulses that it was given before the last time, and then; + where the direction line is
    /// high.
    given: [i32; 2],
}

impl Motor {
    /// Gives it what it does in the next tick.
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
    /// Sets the hardware up; nothing runs but the watch over the emergency input.
    pub(crate) fn new(parts: Parts) -> Self {
        let mut pio = Pio::new(parts.pio, Interrupts);
        let stepper = program::load_stepper(&mut pio.common);
        let pins = |common: &mut Common<'static, PIO0>| {
            let (a, b, c) = parts.step;
            let (d, e, f) = parts.direction;
            [
                (common.make_pio_pin(a), common.make_pio_pin(d)),
                (common.make_pio_pin(b), common.make_pio_pin(e)),
                (common.make_pio_pin(c), common.make_pio_pin(f)),
            ]
        };
        let [a, b, c] = pins(&mut pio.common);
        program::set_up_stepper(&mut pio.sm0, &stepper, &a);
        program::set_up_stepper(&mut pio.sm1, &stepper, &b);
        program::set_up_stepper(&mut pio.sm2, &stepper, &c);
        let emergency = pio.common.make_pio_pin(parts.emergency);
        program::start_watcher(&mut pio.common, &mut pio.sm3, emergency);
        for motor in 0..3 {
            set_up_channel(motor);
        }
        program::set_width(DriverTiming::SLOWEST.high);
        Self {
            _pio: pio,
            _channels: parts.channels,
            motors: [0; 3]
                .map(|_| Motor { segments: Segments::new(DriverTiming::SLOWEST), given: [0; 2] }),
        }
    }

    /// Changes over to other drivers; at standstill.
    pub(crate) fn set_timing(&mut self, timing: DriverTiming) {
        program::set_width(timing.high);
        self.motors.iter_mut().for_each(|motor| motor.segments.set_timing(timing));
    }

    /// Gives the state machines what they do in the next tick.
    pub(crate) fn give(&mut self, plan: &StepPlan) {
        let ([a, b, c], [of_a, of_b, of_c]) = (&mut self.motors, &plan.motors);
        a.give(0, of_a);
        b.give(1, of_b);
        c.give(2, of_c);
    }

    /// Waits until the state machines have done what they were given, a tick at the most.
    pub(crate) fn finish(&mut self) {
        for _ in 0..plumb_core::clock::TICK_CLOCKS {
            if (0..3).all(program::idle) || self.cut_off() {
                break;
            }
        }
    }

    /// Puts the state machines before their first instruction, with nothing to do;
    /// [`run`](Self::run) lets them go.
    pub(crate) fn halt(&mut self) {
        let pio = pac::PIO0;
        pio.ctrl().modify(|w| w.set_sm_enable(w.sm_enable() & !MOTORS));
        for motor in 0..3 {
            program::rewind(motor);
        }
        self.motors.iter_mut().for_each(|motor| motor.segments.restart());
    }

    /// Lets all three go in this very clock.
    pub(crate) fn run(&mut self) {
        pac::PIO0.ctrl().modify(|w| {
            w.set_sm_enable(w.sm_enable() | MOTORS);
            w.set_clkdiv_restart(MOTORS);
        });
    }

    /// Whether the emergency input has opened since the watch over it began.
    pub(crate) fn cut_off(&self) -> bool {
        pac::PIO0.irq().read().irq() & CUT != 0
    }

    /// Whether the emergency input is closed now.
    pub(crate) fn emergency_closed(&self) -> bool {
        pac::SIO.gpio_in(0).read() & (1 << pins::EMERGENCY) == 0
    }

    /// Stops after the emergency input has cut the pulses off: the pulses of each motor that were
    /// planned and not given, + where the direction line is high.
    pub(crate) fn stop(&mut self) -> [i32; 3] {
        let pio = pac::PIO0;
        // A pulse under way ends in 513 clocks; no other begins.
        for _ in 0..513 {
            if pio.dbg_padout().read() & STEP_PINS == 0 {
                break;
            }
        }
        pio.ctrl().modify(|w| w.set_sm_enable(w.sm_enable() & !MOTORS));
        let missing = [0, 1, 2].map(|motor| self.missing(motor));
        self.motors.iter_mut().for_each(|motor| motor.given = [0; 2]);
        missing
    }

    /// Watches the emergency input again.
    pub(crate) fn watch(&mut self) {
        program::rewind_watcher(WATCHER);
        pac::PIO0.irq().write(|w| w.set_irq(CUT));
    }

    /// See [`stop`](Self::stop); the state machine stands still.
    fn missing(&self, motor: usize) -> i32 {
        let [before, last] = self.motors[motor].given;
        // A segment's two words leave the queue as its program begins.
        let (begun, waiting) = match program::queued(motor) {
            0 | 1 => (last, 0),
            _ => (before, last),
        };
        let count = begun.unsigned_abs() as u16;
        let done = match program::progress(motor) {
            program::Progress::Between => count,
            program::Progress::Beginning => 0,
            program::Progress::Within { remaining } => given(count, remaining),
        };
        begun.signum() * i32::from(count - done) + waiting
    }
}

/// Two words a trigger, from wherever the trigger says to the state machine, as fast as it has
/// room.
fn set_up_channel(motor: usize) {
    let channel = pac::DMA.ch(motor);
    channel.write_addr().write_value(pac::PIO0.txf(motor).as_ptr() as u32);
    channel.trans_count().write_value(2);
    // By the alias that starts nothing.
    let mut control = pac::dma::regs::CtrlTrig(0);
    control.set_en(true);
    control.set_high_priority(true);
    control.set_data_size(pac::dma::vals::DataSize::SIZE_WORD);
    control.set_incr_read(true);
    control.set_chain_to(motor as u8);
    control.set_treq_sel(TreqSel::from_bits(motor as u8));
    channel.al1_ctrl().write_value(control.0);
}
