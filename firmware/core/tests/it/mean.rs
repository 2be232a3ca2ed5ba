//! The moving average over a step plan, and the history of motor positions.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::law::Setpoint;
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_core::{MotorRates, TICK_US};
use plumb_protocol::Config;
use plumb_protocol::message::{Command, ConfigField, Jog, State};
use plumb_protocol::units::{Milliseconds, Rate, Steps16};
use proptest::prelude::*;

use crate::common::bench::Bench;
use crate::common::{BUILD, config, motor, params, wiring};

fn planner(mean: u16) -> Planner {
    let mut planner = Planner::default();
    planner.configure(&params(Config { mean: Milliseconds(mean), ..config() }));
    planner
}

#[test]
fn motors_end_at_the_reference_half_the_span_later() {
    let (mut plain, mut mean) = (planner(0), planner(300));
    let rates = MotorRates([300 * 256, -150 * 256, 0]);
    let halfway = |planner: &mut Planner| {
        (0u32..)
            .find(|_| {
                planner.set_rates(rates, 0);
                planner.tick();
                planner.positions()[0] >= 16 * 100
            })
            .unwrap()
    };
    let late = (halfway(&mut mean) - halfway(&mut plain)) * TICK_US;
    assert!((145_000..170_000).contains(&late), "{late} µs");
    let ahead = mean.reference();
    assert!((ahead[0] - mean.positions()[0] - 16 * 45).abs() < 16 * 5, "{ahead:?}");
    for _ in 0..5000 {
        mean.set_rates(MotorRates::default(), 0);
        mean.tick();
    }
    assert!(!mean.moving());
    let rest = mean.reference();
    assert_eq!(mean.positions(), rest);
    // The ramp down takes the reference 300²/(2 · 2000) steps farther.
    assert!((rest[0] - ahead[0] - 16 * 45 / 2).abs() < 16 * 2, "{rest:?} after {ahead:?}");
}

/// Turns the motors for the tick `k`: A to and fro, B and C evenly.
fn wander(planner: &mut Planner, k: i32) {
    planner.set_rates(MotorRates([(k % 1700 - 800) * 100, 20_000, -30_000]), 0);
    planner.tick();
}

#[test]
fn earlier_positions_are_interpolated() {
    let mut planner = planner(0);
    let mut past = Vec::new();
    for k in 0..4000 {
        wander(&mut planner, k);
        past.push(planner.positions());
    }
    for ago in [0, 3, 40, 41, 333, 1000, 2400] {
        let then = planner.positions_ago(ago * TICK_US);
        let was = past[past.len() - 1 - ago as usize];
        for i in 0..3 {
            assert!((then[i] - was[i]).abs() <= 3, "{ago} ticks ago: {then:?} for {was:?}");
        }
    }
}

#[test]
fn positions_of_any_age_are_interpolated_up_to_the_oldest() {
    let mut planner = planner(0);
    let mut past = Vec::new();
    for k in 0..4000 {
        wander(&mut planner, k);
        past.push(planner.positions());
        if k < 3900 {
            continue;
        }
        for ago in (0..100).chain([333, 1000, 2500, 2519]) {
            let then = planner.positions_ago(ago * TICK_US);
            let was = past[past.len() - 1 - ago as usize];
            assert!((0..3).all(|i| (then[i] - was[i]).abs() <= 3), "{ago}: {then:?} for {was:?}");
        }
        // An entry every 40 ticks, 64 of them. The newest is up to 39 ticks old.
        let oldest = planner.positions_ago(u32::MAX);
        let entered = past.len() - 1 - (past.len() % 40) - 63 * 40;
        assert_eq!(oldest, past[entered]);
        assert_eq!(oldest, planner.positions_ago(64 * 40 * TICK_US));
    }
}

/// Returns a planner with an average of 400 ms that has turned motor A at `rate`, steps/s, for 2 s.
fn turning(rate: f64, microsteps: u8) -> Planner {
    let motors = [motor(rate, 2000, 1 << 24); 3];
    let config = Config { motors: motors.into(), microsteps, mean: Milliseconds(400), ..config() };
    let mut planner = Planner::default();
    planner.configure(&params(config));
    planner.set_rates(MotorRates([(rate * 256.0) as i32, -256, 0]), 0);
    (0..10_000).for_each(|_| _ = planner.tick());
    planner
}

#[test]
fn motors_end_at_the_reference_with_any_microsteps() {
    for microsteps in [1, 4, 16] {
        let mut planner = turning(300.0, microsteps);
        // The reference ramps down in 750 ticks, and the motors follow for 400 ms.
        planner.set_rates(MotorRates::default(), 0);
        (0..760).for_each(|_| _ = planner.tick());
        let (reference, positions) = (planner.reference(), planner.positions());
        assert!(reference[0] - positions[0] > 16, "{reference:?} {positions:?}");
        (0..2200).for_each(|_| _ = planner.tick());
        assert!(!planner.moving());
        let pulse = 16 / i32::from(microsteps);
        let off = (0..3).map(|i| (planner.positions()[i] - reference[i]).abs());
        assert!(off.max().unwrap() <= pulse, "{reference:?} {:?}", planner.positions());
    }
}

#[test]
fn the_average_outlives_an_emergency_stop() {
    let mut planner = turning(300.0, 16);
    planner.cut([0; 3]);
    assert!(!planner.moving());
    let (cut, mut ticks) = (planner.positions()[0], 0);
    planner.set_rates(MotorRates([300 * 256, 0, 0]), 0);
    while planner.positions()[0] < cut + 16 * 100 {
        planner.tick();
        ticks += 1;
    }
    // A third of a second, half of a ramp of 150 ms, and half of the span.
    let time_ms = ticks * TICK_US / 1000;
    assert!((600..630).contains(&time_ms), "{time_ms} ms");
}

/// The reference is ahead of the motor by half the span, whether the motor takes a third of a pulse
/// a tick, one and a half, or ten.
#[test]
fn a_motor_behind_its_reference_stops_before_its_travel() {
    for rate in [100.0, 470.0, 3000.0] {
        let travel = 16 * 3 * rate as i32;
        let config = Config {
            motors: [motor(rate, 2000, travel); 3].into(),
            mean: Milliseconds(400),
            ..config()
        };
        let mut planner = Planner::default();
        planner.configure(&params(config));
        planner.set_rates(MotorRates([(rate * 256.0) as i32, 0, 0]), 0);
        let named: Vec<_> = (0..40_000).filter_map(|_| planner.tick()).collect();
        let end = planner.positions()[0];
        assert_eq!((named.first(), planner.moving()), (Some(&0), false));
        assert!((travel * 9 / 10..=travel).contains(&end), "{end} of {travel}");
    }
}

#[test]
fn a_span_above_the_limit_is_refused() {
    let config = Config { mean: Milliseconds(401), ..config() };
    assert_eq!(Params::check(&config, &wiring().drivers, &BUILD), Err(ConfigField::Mean));
}

/// Jogs motor A by 50 steps through a mean of `mean_ms`, with a Stop after `stop_ms`. Returns the
/// position at rest, Q4 steps, and the time until then, ms.
fn jog(mean_ms: u16, stop_ms: Option<u64>) -> (i32, u64) {
    let mut bench = Bench::configured(Config { mean: Milliseconds(mean_ms), ..config() });
    let jog = Jog { motor: 0, distance: Steps16(16 * 50), rate: Rate(40 << 8) };
    assert_eq!(bench.send(Command::Jog(jog)), Ok(()));
    let time = (1..5_000u64).find(|ms| {
        if stop_ms == Some(*ms) {
            assert_eq!(bench.send(Command::Stop), Ok(()));
        }
        if ms % 100 == 0 {
            assert_eq!(bench.send(Command::Status), Ok(()));
        }
        bench.run_ms(1);
        bench.harness.board.state() == State::Ready
    });
    assert!(!bench.moving());
    (bench.harness.board.positions()[0], time.unwrap())
}

#[test]
fn a_jog_and_its_stop_end_within_the_span_later_at_the_same_step() {
    for stop_ms in [None, Some(700)] {
        let ((plain, at), (mean, later)) = (jog(0, stop_ms), jog(400, stop_ms));
        assert!((at..=at + 420).contains(&later), "{later} ms for {at} ms");
        assert!((plain - mean).abs() <= 16, "{mean} for {plain}");
    }
    assert_eq!(jog(400, None).0, 16 * 50);
}

/// Returns the setpoint of a law that turns motor A at `rate` (full steps/s) through this span.
fn through(rate: f64, span_ms: u16) -> Setpoint {
    let rates = MotorRates([(rate * 256.0) as i32, 0, 0]);
    Setpoint { span_ms: Some(span_ms), ..Setpoint::at_once(rates) }
}

/// At a constant rate the reference is ahead by half the span. A span of 400 ms takes 200 ms to
/// become one of 200 ms, and as long to become that again.
#[test]
fn a_span_changes_by_a_cell_a_cell_while_motors_turn() {
    let mut planner = planner(400);
    let mut lag_ms = |span_ms, ticks| {
        for _ in 0..ticks {
            planner.follow(&through(300.0, span_ms));
            planner.tick();
        }
        f64::from(planner.reference()[0] - planner.positions()[0]) / 16.0 / 300.0 * 1e3
    };
    let near = |lag: f64, expected: f64| (lag - expected).abs() < 6.0;
    let lags = [(400, 5000), (200, 500), (200, 600), (400, 500), (400, 600), (1, 2400), (0, 16)]
        .map(|(span_ms, ticks)| lag_ms(span_ms, ticks));
    for (lag, expected) in lags.into_iter().zip([200.0, 150.0, 100.0, 150.0, 200.0, 3.0, 3.0]) {
        assert!(near(lag, expected), "{lags:?}");
    }
}

/// A setpoint without a span leaves it, and no setpoint makes it longer than the configured one.
#[test]
fn a_span_is_at_most_the_configured_one() {
    let mut planner = planner(300);
    for (span_ms, lag_ms) in [(Some(u16::MAX), 150.0), (Some(100), 50.0), (None, 50.0)] {
        for _ in 0..5000 {
            planner.follow(&Setpoint { span_ms, ..through(300.0, 0) });
            planner.tick();
        }
        let ahead = f64::from(planner.reference()[0] - planner.positions()[0]) / 16.0;
        assert!((ahead / 0.3 - lag_ms).abs() < 6.0, "{ahead} steps for {lag_ms} ms");
    }
}

/// Returns rates, full steps/s, each for some ticks and with a span, ms.
fn orders() -> impl Strategy<Value = Vec<([f64; 3], usize, u16)>> {
    let order = (proptest::array::uniform3(-400.0f64..400.0), 1usize..400, 0u16..=400);
    proptest::collection::vec(order, 1..12)
}

proptest! {
    /// Rates and their changes stay within the limits, and no motor passes its travel, for any
    /// spans.
    #[test]
    fn limits_hold_through_the_mean(
        span in 0u16..=400,
        orders in orders(),
    ) {
        let motors = [motor(400.0, 2000, 16 * 300); 3];
        let config = Config { motors: motors.into(), mean: Milliseconds(span), ..config() };
        let mut planner = Planner::default();
        planner.configure(&params(config));
        let mut last = [0; 3];
        for (rates, ticks, span_ms) in orders {
            let rates = MotorRates(rates.map(|r| (r * 256.0) as i32));
            let setpoint = Setpoint { span_ms: Some(span_ms), ..Setpoint::at_once(rates) };
            for _ in 0..ticks {
                planner.follow(&setpoint);
                planner.tick();
                let (now, at) = (planner.rates(), planner.positions());
                for i in 0..3 {
                    // 2000 steps/s² in a tick are 102.4 in Q8.
                    prop_assert!((now[i] - last[i]).abs() <= 104, "{} to {}", last[i], now[i]);
                    prop_assert!(now[i].abs() <= 400 * 256 && at[i].abs() <= 16 * 300, "{at:?}");
                }
                last = now;
            }
        }
    }
}
