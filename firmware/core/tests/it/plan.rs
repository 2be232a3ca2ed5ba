//! Step plans: exact counts, ramps within the limits, no motor past its travel.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use plumb_core::plan::{Jogging, Planner};
use plumb_core::timing::{CLOCK_HZ, TICK_CLOCKS, TICK_US};
use plumb_core::{MotorRates, StepPlan};
use plumb_protocol::Config;
use proptest::prelude::*;

use crate::common::{config, motor, params};

const TICKS_PER_S: u32 = 1_000_000 / TICK_US;

/// Observer of a planner: it counts pulses and checks their times and the changes of rates.
struct Watch {
    planner: Planner,
    config: Config,
    counted: [i32; 3],
    last_rates: [i32; 3],
}

impl Watch {
    fn new(config: Config) -> Self {
        let mut planner = Planner::default();
        planner.configure(&params(config));
        Self { planner, config, counted: [0; 3], last_rates: [0; 3] }
    }

    fn tick(&mut self, wanted: [i32; 3]) -> Option<usize> {
        self.planner.set_rates(MotorRates(wanted), 0);
        self.go_on()
    }

    /// Runs a tick at the rates that were set last.
    fn go_on(&mut self) -> Option<usize> {
        let beyond = self.planner.tick();
        let plan = *self.planner.plan();
        self.check_pulses(&plan);
        self.check_limits();
        beyond
    }

    /// Checks that the sum of the pulses is the planner's position, and that all lie within their
    /// tick.
    fn check_pulses(&mut self, plan: &StepPlan) {
        for (i, pulses) in plan.motors.iter().enumerate() {
            let step = 16 / i32::from(self.config.microsteps);
            let forward = pulses.direction != self.config.motors[i].reversed;
            self.counted[i] += i32::from(pulses.count) * if forward { step } else { -step };
            if pulses.count > 0 {
                let last = pulses.first + u32::from(pulses.count - 1) * pulses.period;
                assert!(last < TICK_CLOCKS, "pulses {pulses:?}");
            }
        }
        assert_eq!(self.counted, self.planner.positions());
    }

    fn check_limits(&mut self) {
        let rates = self.planner.rates();
        for i in 0..3 {
            let limits = &self.config.motors[i];
            assert!(rates[i].abs() <= limits.max_rate.0, "rate {rates:?}");
            // a · tick in Q8; one more, since the rates are rounded.
            let change = f64::from(limits.max_acceleration.0) * 256.0 / f64::from(TICKS_PER_S);
            assert!(f64::from(rates[i] - self.last_rates[i]).abs() <= change + 1.0, "acceleration");
            let position = self.planner.positions()[i];
            assert!(
                (limits.travel_min.0..=limits.travel_max.0).contains(&position),
                "travel: {position}"
            );
        }
        self.last_rates = rates;
    }
}

fn configs() -> impl Strategy<Value = Config> {
    let one = (1.0f64..20_000.0, 40u32..200_000, 100i32..200_000, any::<bool>());
    (proptest::array::uniform3(one), 0u32..5).prop_map(|(motors, shift)| Config {
        motors: motors
            .map(|(rate, acceleration, travel, reversed)| plumb_protocol::config::Motor {
                reversed,
                ..motor(rate, acceleration, travel)
            })
            .into(),
        microsteps: 1 << shift,
        ..config()
    })
}

/// Returns rates as fractions of the limits, each for some ticks.
fn orders() -> impl Strategy<Value = Vec<([f64; 3], usize)>> {
    proptest::collection::vec((proptest::array::uniform3(-1.0f64..=1.0), 1usize..200), 1..20)
}

/// Returns rates, Q8 steps/s, at fractions of the motors' limits.
fn rates(config: &Config, fractions: [f64; 3]) -> [i32; 3] {
    [0, 1, 2].map(|i| (fractions[i] * f64::from(config.motors[i].max_rate.0)) as i32)
}

proptest! {
    #[test]
    fn limits_hold_for_any_rates(config in configs(), orders in orders()) {
        let mut watch = Watch::new(config);
        for (fractions, ticks) in orders {
            let wanted = rates(&config, fractions);
            for _ in 0..ticks {
                watch.tick(wanted);
            }
        }
    }

    /// A law sets its rates once, and the planner checks the travel by itself.
    #[test]
    fn limits_hold_for_rates_that_are_set_once(config in configs(), orders in orders()) {
        let mut watch = Watch::new(config);
        for (fractions, ticks) in orders {
            watch.planner.set_rates(MotorRates(rates(&config, fractions)), 0);
            for _ in 0..10 * ticks {
                watch.go_on();
            }
        }
    }

    /// From any rates, ramping down ends at rest, within the travel, and then nothing moves.
    #[test]
    fn a_stop_ends_at_rest(
        config in configs(), fractions in proptest::array::uniform3(-1.0f64..=1.0)
    ) {
        let mut watch = Watch::new(config);
        let wanted = rates(&config, fractions);
        for _ in 0..500 {
            watch.tick(wanted);
        }
        let seconds = |i: usize| {
            let acceleration = f64::from(config.motors[i].max_acceleration.0);
            f64::from(watch.planner.rates()[i].abs()) / 256.0 / acceleration
        };
        // The change of a tick is rounded down to a whole unit, of eight or more.
        let longest = seconds(0).max(seconds(1)).max(seconds(2)) * 9.0 / 8.0;
        for _ in 0..(longest * f64::from(TICKS_PER_S)) as u32 + 2 {
            prop_assert_eq!(watch.tick([0; 3]), None);
        }
        prop_assert!(!watch.planner.moving());
    }

    /// While the rates do not change, the pulses are even across ticks, to the clocks of rounding.
    #[test]
    fn pulses_are_even_at_a_constant_rate(steps_q8 in 10_000i32..200_000) {
        let mut planner = Planner::default();
        let motors = [motor(1000.0, 4_000_000, 1 << 24); 3];
        planner.configure(&params(Config { motors: motors.into(), ..config() }));
        let (mut times, mut start) = (Vec::new(), 0u32);
        for _ in 0..1000 {
            planner.set_rates(MotorRates([steps_q8, 0, 0]), 0);
            planner.tick();
            let a = planner.plan().motors[0];
            times.extend((0..u32::from(a.count)).map(|k| start + a.first + k * a.period));
            start += TICK_CLOCKS;
        }
        let period = f64::from(CLOCK_HZ) / (f64::from(steps_q8) / 256.0 * 16.0);
        // The first four pulses come before the full rate.
        for pair in times[4..].windows(2) {
            let measured = f64::from(pair[1] - pair[0]);
            prop_assert!((measured - period).abs() <= 3.0, "{measured} for {period}");
        }
    }

    #[test]
    fn a_jog_ends_exactly_where_it_should(
        config in configs(), motor in 0usize..3, steps in -40i32..=40, share in 0.1f64..=1.0
    ) {
        let mut watch = Watch::new(config);
        let travel = config.motors[motor].travel_max.0;
        let per_pulse = 16 / i32::from(config.microsteps);
        let end = (16 * steps).clamp(-travel, travel) / per_pulse * per_pulse;
        let rate = ((share * f64::from(config.motors[motor].max_rate.0)) as i32).max(1);
        let jogging = Jogging::new(motor, end, rate);
        // The time at the full rate, a ramp at each end, and a reserve for the last steps at the
        // least rate.
        let acceleration = f64::from(config.motors[motor].max_acceleration.0);
        let (distance, rate) = (f64::from(end.abs()) / 16.0, f64::from(rate) / 256.0);
        let seconds = distance / rate + rate / acceleration + (distance / acceleration).sqrt();
        let timeout = 2.0 * f64::from(TICKS_PER_S) * seconds + 2000.0;
        let mut ticks = 0;
        while let Some(wanted) = jogging.wanted(&watch.planner) {
            prop_assert_eq!(watch.tick(wanted.0), None);
            ticks += 1;
            prop_assert!(f64::from(ticks) < timeout, "not there after {ticks} ticks");
        }
        prop_assert_eq!(watch.planner.positions()[motor], end);
    }
}

/// At half a microstep a tick, every other tick ends at a microstep's begin.
#[test]
fn a_pulse_at_the_end_of_a_tick_comes_in_the_next_one() {
    let mut planner = Planner::default();
    let motors = [motor(1000.0, 4_000_000, 1 << 24); 3];
    planner.configure(&params(Config { motors: motors.into(), ..config() }));
    // 2500 microsteps/s from the middle of a microstep on.
    planner.set_rates(MotorRates([-2500 * 256 / 16, 0, 0]), 0);
    for tick in 1..=20i32 {
        planner.tick();
        assert_eq!(planner.positions()[0], (1 - tick).div_euclid(2), "tick {tick}");
    }
}

#[test]
fn the_common_factor_keeps_the_direction_of_a_ramp() {
    let mut watch = Watch::new(config());
    for tick in 1..=750 {
        watch.tick([100 * 256, -50 * 256, 25 * 256]);
        let [a, b, c] = watch.planner.rates();
        if tick <= 250 {
            assert!((a + 2 * b).abs() <= 4 && (a - 4 * c).abs() <= 8, "tick {tick}: {a} {b} {c}");
        }
    }
    assert_eq!(watch.planner.rates(), [100 * 256, -50 * 256, 25 * 256]);
}

#[test]
fn a_ramp_takes_as_long_as_it_is_asked_for() {
    for (ramp_us, ticks) in [(33_000, 165), (33_199, 165), (20_000, 100)] {
        let mut planner = Planner::default();
        planner.configure(&params(config()));
        planner.set_rates(MotorRates([2560, 0, 0]), ramp_us);
        for tick in 1..=ticks {
            planner.tick();
            assert!((planner.rates()[0] - 2560 * tick / ticks).abs() <= 1, "tick {tick}");
        }
    }
}

#[test]
fn a_motor_stops_before_its_travel_and_is_named() {
    let mut watch =
        Watch::new(Config { motors: [motor(400.0, 2000, 16 * 100); 3].into(), ..config() });
    let named: Vec<_> = (0..5000).filter_map(|_| watch.tick([0, 300 * 256, 0])).collect();
    assert_eq!(named.first(), Some(&1));
    assert!(
        watch.planner.positions()[1] > 16 * 90,
        "it uses its travel: {:?}",
        watch.planner.positions()
    );
}

#[test]
fn the_count_of_steps_is_the_integral_of_the_rate() {
    // 100 steps/s for 10 s, less half of a ramp of 50 ms at each end, to the microstep.
    let mut watch = Watch::new(config());
    for _ in 0..10 * TICKS_PER_S {
        watch.tick([100 * 256, 0, 0]);
    }
    for _ in 0..TICKS_PER_S / 10 {
        watch.tick([0; 3]);
    }
    let steps = f64::from(watch.planner.positions()[0]) / 16.0;
    assert!((steps - 1000.0).abs() < 0.2, "{steps}");
}
