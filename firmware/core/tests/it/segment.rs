//! The words for the step generator, executed as its program does: no pulse is lost or late, and
//! every time of the driver holds.

#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::law::MotorRates;
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_core::segment::{Segments, given};
use plumb_core::timing::{DriverTiming, PulseWidth, TICK_CLOCKS};
use plumb_core::{Pulses, StepPlan};
use plumb_protocol::Config;
use plumb_protocol::units::{Milliseconds, Nanoseconds};
use plumb_protocol::wiring::{Drivers, StepDir};
use proptest::prelude::*;

/// State machine that runs firmware/src/generator/program.rs, one instruction a clock.
struct Machine {
    high: u64,
    clock: u64,
    direction: bool,
    /// Pulses: the clock at which each began, with the direction line's level.
    pulses: Vec<(u64, bool)>,
    /// Clocks at which the direction line changed.
    turns: Vec<u64>,
}

impl Machine {
    fn new(timing: &DriverTiming) -> Self {
        let high = u64::from(timing.high.clocks());
        Self { high, clock: 0, direction: false, pulses: Vec::new(), turns: Vec::new() }
    }

    fn run(&mut self, (first, second): (u32, u32)) {
        // pull; out y, 10; out isr, 16; out pins, 1 (the level is there a clock later); out x, 1;
        // pull; jmp !x
        let (mut y, isr) = (first & 0x3ff, u64::from(first >> 10 & 0xffff));
        let (direction, any) = (first >> 26 & 1 != 0, first >> 27 & 1 != 0);
        if direction != self.direction {
            self.turns.push(self.clock + 4);
            self.direction = direction;
        }
        self.clock += 7;
        let mut second = u64::from(second);
        if any {
            // out x, 16; jmp delay; x + 1 times jmp x--; wait irq
            self.clock += 2 + (second & 0xffff) + 1 + 1;
            second >>= 16;
            loop {
                self.pulses.push((self.clock, direction));
                // set x and the loop; jmp y--
                self.clock += self.high + 1;
                if y == 0 {
                    break;
                }
                y -= 1;
                // mov x, isr; isr + 1 times jmp x--; wait irq
                self.clock += 1 + isr + 1 + 1;
            }
        }
        // out x, 16; x + 1 times jmp x--
        self.clock += 1 + (second & 0xffff) + 1;
    }
}

/// Runs plans through the words and the machine, and checks the driver's inputs.
fn check(timing: DriverTiming, plans: &[Pulses]) -> Machine {
    let mut segments = Segments::new(timing);
    let mut machine = Machine::new(&timing);
    let mut planned = Vec::new();
    for (tick, pulses) in plans.iter().enumerate() {
        let start = tick as u64 * u64::from(TICK_CLOCKS);
        assert!(machine.clock >= start, "a segment ended early");
        assert!(machine.clock - start <= 3000, "late by {}", machine.clock - start);
        machine.run(segments.next(pulses));
        planned.extend((0..u64::from(pulses.count)).map(|k| {
            (start + u64::from(pulses.first) + k * u64::from(pulses.period), pulses.direction)
        }));
    }
    assert_eq!(machine.pulses.len(), planned.len());
    for (given, planned) in machine.pulses.iter().zip(&planned) {
        assert_eq!(given.1, planned.1, "the direction");
        // The last clocks of a period of one pulse are the plan's rounding.
        assert!(given.0 >= planned.0 && given.0 - planned.0 <= 3000, "{given:?} for {planned:?}");
    }
    let (low, hold) = (u64::from(timing.low), u64::from(timing.hold));
    for pair in machine.pulses.windows(2) {
        assert!(pair[1].0 - pair[0].0 >= machine.high + low, "too close: {pair:?}");
    }
    for &turn in &machine.turns {
        let next = machine.pulses.iter().find(|p| p.0 >= turn);
        assert!(next.is_none_or(|p| p.0 - turn >= u64::from(timing.setup)), "set-up at {turn}");
        let last = machine.pulses.iter().rev().find(|p| p.0 < turn);
        assert!(last.is_none_or(|p| turn - p.0 >= hold), "hold at {turn}");
    }
    machine
}

/// Returns the plans of a motor whose rate changes at times, and that comes to rest at the end.
fn plans(timing: &StepDir, acceleration: u32, wanted: &[(i32, u8)]) -> Vec<Pulses> {
    let max = DriverTiming::new(timing).unwrap().max_pulse_rate().min(1_000_000) / 16;
    let motor = crate::common::motor(f64::from(max), acceleration, 1 << 28);
    let config = Config { motors: [motor; 3].into(), ..crate::common::config() };
    let mut planner = Planner::default();
    let drivers = Drivers::StepDir(*timing);
    planner.configure(&Params::check(&config, &drivers, &crate::common::BUILD).unwrap());
    let mut plans = Vec::new();
    let mut tick = |per_mille: i32| {
        let rate = (i64::from(per_mille) * i64::from(motor.max_rate.0) / 1000) as i32;
        planner.set_rates(MotorRates([rate, 0, 0]), 0);
        planner.tick();
        let StepPlan { motors } = *planner.plan();
        plans.push(motors[0]);
        planner.moving()
    };
    for &(per_mille, ticks) in wanted {
        (0..ticks).for_each(|_| _ = tick(per_mille));
    }
    while tick(0) {}
    tick(0);
    plans
}

fn drivers() -> impl Strategy<Value = StepDir> {
    let ns = |max: u16| (0..=max).prop_map(Nanoseconds);
    prop_oneof![
        Just(StepDir::A4988),
        Just(StepDir::DRV8825),
        Just(StepDir::TMC2209),
        Just(StepDir::TB6600),
        Just(StepDir::DM542),
        (ns(4000), ns(4000), ns(4000), ns(9000)).prop_map(|(high, low, setup, hold)| {
            StepDir { high, low, setup, hold, enable: Milliseconds(0) }
        }),
    ]
}

proptest! {
    #[test]
    fn every_pulse_comes_once_in_time_and_as_the_driver_needs_it(
        driver in drivers(),
        acceleration in 1000u32..4_000_000,
        wanted in proptest::collection::vec((-1000i32..=1000, 1u8..30), 1..12),
    ) {
        let timing = DriverTiming::new(&driver).unwrap();
        let plans = plans(&driver, acceleration, &wanted);
        let machine = check(timing, &plans);
        let clocks = plans.len() as u64 * u64::from(TICK_CLOCKS);
        prop_assert_eq!(machine.clock, clocks, "in step again at rest");
    }

    #[test]
    fn widths_are_the_least_that_are_wide_enough(clocks in 0u32..513) {
        let width = PulseWidth::at_least(clocks).unwrap();
        prop_assert!(width.rounds < 32 && width.delay < 16);
        prop_assert!(width.clocks() >= clocks && width.clocks() <= clocks.max(2) + clocks / 16 + 1);
    }
}

#[test]
fn without_constraints_pulses_come_at_the_clocks_of_the_plan() {
    let timing = DriverTiming::new(&StepDir::TMC2209).unwrap();
    let pulses = Pulses { direction: true, count: 100, first: 77, period: 250 };
    let machine = check(timing, &[pulses, Pulses::default(), pulses]);
    let expected: Vec<u64> =
        [0, 50_000].iter().flat_map(|t| (0..100).map(move |k| t + 77 + 250 * k)).collect();
    assert_eq!(machine.pulses.iter().map(|p| p.0).collect::<Vec<_>>(), expected);
}

/// A TMC2209 samples its inputs with its own clock, nominally 12 MHz. By its data sheet (rev. 1.09,
/// section 13.1) STEP must be high and low for a period and 20 ns; 11.5 MHz are the least.
#[test]
fn a_tmc2209_sees_every_pulse_with_half_a_period_to_spare() {
    let timing = DriverTiming::new(&StepDir::TMC2209).unwrap();
    let period_ns = 1e9 / 11.5e6;
    for clocks in [timing.high.clocks(), timing.low] {
        let ns = f64::from(clocks) * 8.0;
        assert!(ns >= 1.5 * period_ns + 20.0, "{ns} ns");
    }
    // DIR is set up for 20 ns, at least.
    assert!(timing.setup * 8 >= 40, "{} clocks", timing.setup);
    assert!(timing.max_pulse_rate() > 1_250_000, "the highest rate of the firmware holds");
}

#[test]
fn too_wide_a_pulse_is_refused() {
    assert_eq!(PulseWidth::at_least(514), None);
    assert!(DriverTiming::new(&StepDir { high: Nanoseconds(4200), ..StepDir::A4988 }).is_none());
}

#[test]
fn the_counter_tells_the_pulses_given_of_a_segment() {
    // Ten pulses: before the first the counter is 9; after the last it has gone below 0.
    assert_eq!([9, 8, 0, u32::MAX].map(|remaining| given(10, remaining)), [0, 1, 9, 10]);
    assert_eq!(given(0, 9), 0);
}
