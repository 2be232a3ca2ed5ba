//! The corners of the accepted ranges, every combination: no step of the arithmetic overflows.
//!
//! An overflow panics in this build. Where a law wraps without a check, because a check takes the
//! chip too long, the result is compared with exact arithmetic.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use crate::common::{BUILD, config, wiring};
use plumb_core::law::{DeferredLaw, DeferredLawKind, Law as _, Measurement, variances};
use plumb_core::params::Params;
use plumb_core::plan::Planner;
use plumb_core::{BuildLimits, MotorRates};
use plumb_protocol::Config;
use plumb_protocol::config::{Interval, Law, Motor, Sign};
use plumb_protocol::units::{
    Acceleration, Bound, Covariance, Gain, Milliseconds, Rate, SignGain, Steps16,
};

/// Highest pulse rate of the firmware's step generator, 1/s.
const PULSES: u32 = 1_250_000;
/// Limits of a build as fast as the planner allows.
const FASTEST: BuildLimits = BuildLimits { max_pulse_rate: PULSES, ..BUILD };
/// Largest |coordinate|, µm.
const FAR: i32 = 4_000_000;
/// Corners of a difference of two coordinates, µm, with those of the laws' saturation.
const ERRORS: [i32; 9] = [-2 * FAR, -(1 << 22), -1, 0, 1, 12_000, (1 << 22) - 1, 1 << 23, 2 * FAR];
/// Smallest and largest acceleration, steps/s².
const ACCELERATIONS: [u32; 2] = [40, 4_000_000];
/// Widest travel, 1/16 steps.
const WIDEST: i32 = 1 << 29;

fn params(config: Config) -> Params {
    Params::check(&config, &wiring().drivers, &FASTEST).unwrap()
}

/// Returns every difference of two positions with corners as its coordinates.
fn errors() -> impl Iterator<Item = [i32; 3]> {
    ERRORS.iter().flat_map(|&x| ERRORS.iter().flat_map(move |&y| ERRORS.map(|z| [x, y, z])))
}

/// Returns v of the law `interval` with exact arithmetic: eqs. (7) and (8), Q8 µm.
fn exact_v(law: &Interval, e: [i32; 3]) -> [i32; 3] {
    // The law saturates |e| at 27 bits of Q4 µm.
    let most = (1 << 27) - 1;
    let e = e.map(|e| (i128::from(e) << 4).clamp(-most, most));
    [0, 1, 2].map(|k| {
        let (mut eta, mut mu) = (0_i128, 0_i128);
        for (i, e) in e.into_iter().enumerate() {
            let sign = i128::from(law.signs[i][k]);
            let ends = [law.alpha[i][k], law.beta[i][k]].map(|b| sign * i128::from(b.0) * e);
            eta += ends[0].min(ends[1]);
            mu += ends[0].max(ends[1]);
        }
        let nearest_to_zero = eta.max(0) + mu.min(0);
        let magnitude = (nearest_to_zero.unsigned_abs() >> 12).min(1 << 27) as i32;
        if nearest_to_zero < 0 { -magnitude } else { magnitude }
    })
}

/// Returns a family with the bounds `alpha` to `beta`, with sign pattern number `pattern` of 3^9.
fn family(pattern: usize, [alpha, beta]: [u32; 2], gain: u32) -> Interval {
    let mut law = Interval::uniform(Bound(alpha), Bound(beta), Gain(gain));
    for (place, sign) in law.signs.iter_mut().flat_map(|row| row.iter_mut()).enumerate() {
        *sign = (pattern / 3_usize.pow(place as u32) % 3) as i8 - 1;
    }
    law
}

#[test]
fn the_law_interval_is_exact_at_the_corners_of_its_bounds_and_errors() {
    const LARGEST: u32 = 8 << 16;
    let mut checked = 0;
    for pattern in 0..3_usize.pow(9) {
        for bounds in [[1, 1], [1, LARGEST], [LARGEST, LARGEST]] {
            let law = family(pattern, bounds, 16 << 16);
            let config = Config { law: Law::Interval(law), ..config() };
            // A motor without a sign moves nothing, which is refused.
            let Ok(params) = Params::check(&config, &wiring().drivers, &FASTEST) else { continue };
            let fast = params.interval().unwrap();
            // Every pattern with some errors, one pattern in a hundred with all of them.
            let step = if pattern % 100 == 0 { 1 } else { 61 };
            for e in errors().step_by(step) {
                assert_eq!(fast.v(e), exact_v(&law, e), "{law:?} {e:?}");
                let _rates = fast.rates(e).within([1; 3]).coasting();
                checked += 1;
            }
        }
    }
    assert!(checked > 500_000, "{checked}");
}

#[test]
fn the_law_sign_takes_every_corner_after_every_other() {
    for gain in [1, 1 << 20] {
        let law = Law::Sign(Sign { gain: SignGain(gain) });
        let params = params(Config { law, ..config() });
        let plumb_core::law::LawSelection::Inline(mut law) = params.law() else { panic!() };
        for e in errors() {
            for target in [[0; 3], [FAR; 3], [-FAR; 3]] {
                let ball = [0, 1, 2].map(|i| e[i].clamp(-FAR, FAR));
                let setpoint = law.update(&measurement(ball, target, [0; 3], None));
                let _within = setpoint.rates.within([1, 320_000_000, 1]).coasting();
            }
        }
    }
}

fn measurement(
    ball: [i32; 3],
    target: [i32; 3],
    motors: [i32; 3],
    covariance: Option<Covariance>,
) -> Measurement {
    Measurement {
        ball,
        variances: variances(covariance),
        motors,
        motors_before: [motors.map(|at| -at), [0; 3]],
        motors_ahead: motors.map(|at| at / 2),
        target,
        velocity: [0; 3],
    }
}

#[test]
fn the_laws_that_estimate_take_the_corners_in_any_order() {
    let covariances = [
        None,
        Some(Covariance { variances: [0; 3], covariances: [0; 3] }),
        Some(Covariance { variances: [u16::MAX; 3], covariances: [i16::MIN; 3] }),
        Some(Covariance { variances: [u16::MAX, 0, 1], covariances: [i16::MAX, 0, -1] }),
    ];
    for kind in [DeferredLawKind::Adaptive, DeferredLawKind::Taut] {
        for (rate, acceleration) in
            [1, 1_250_000 << 8].into_iter().flat_map(|rate| ACCELERATIONS.map(|a| (rate, a)))
        {
            let motor = Motor { max_rate: Rate(rate), ..widest_motor(acceleration) };
            let params = params(Config { motors: [motor; 3].into(), microsteps: 1, ..config() });
            let mut law = DeferredLaw::new(kind, params.limits(), None, &mut None);
            for (n, e) in errors().enumerate() {
                let ball = e.map(|e| e.clamp(-FAR, FAR));
                let target = [ball, ball.map(|c| -c), [0; 3], [FAR; 3]][n % 4];
                let at = [WIDEST, -WIDEST, 0, 16, -1][n % 5];
                let motors = [[at; 3], [at, -at, 0], [0, 0, at]][n % 3];
                let setpoint = law.update(&measurement(ball, target, motors, covariances[n % 4]));
                let MotorRates(rates) = setpoint.rates.within([rate; 3]);
                assert!(rates.iter().all(|r| r.abs() <= rate), "{rates:?} of {rate}");
                let _later = setpoint.after(u64::from(u32::MAX));
            }
        }
    }
}

fn widest_motor(acceleration: u32) -> Motor {
    Motor {
        max_rate: Rate(1),
        max_acceleration: Acceleration(acceleration),
        travel_min: Steps16(-WIDEST),
        travel_max: Steps16(WIDEST),
        reversed: false,
    }
}

/// Drives the motors to both ends and to and fro. They must stay within their travel.
fn drive(config: &Config) {
    let mut planner = Planner::default();
    planner.configure(&params(*config));
    let limits = config.motors.map(|motor| motor.max_rate.0);
    for tick in 0..1_500 {
        let factors = match tick / 250 {
            0 => [1, 1, 1],
            1 => [-1, -1, -1],
            2 => [1, -1, 0],
            3 => [[1, -1, 1], [-1, 1, -1]][tick % 2],
            4 => [[1, 0, -1], [0, 1, 0], [-1, -1, 1]][tick % 3],
            _ => [0; 3],
        };
        let ramp_us = [0, 1, 33_000, u32::MAX][tick % 4];
        planner.set_rates(MotorRates([0, 1, 2].map(|i| factors[i] * limits[i])), ramp_us);
        planner.tick();
        for (at, motor) in planner.positions().iter().zip(&config.motors) {
            let travel = motor.travel_min.0..=motor.travel_max.0;
            assert!(travel.contains(at), "{at} is outside {travel:?}");
        }
        let _ago = planner.positions_ago([0, 1, 500_000, u32::MAX][tick % 4]);
    }
}

/// Each motor has another corner of rate and acceleration, and all combinations are tried.
#[test]
fn the_planner_takes_every_combination_of_corners() {
    let corners = |microsteps: u8| {
        let fastest = (u64::from(PULSES) << 8) / u64::from(microsteps);
        [1, 256, fastest as i32].into_iter().flat_map(|rate| ACCELERATIONS.map(|a| (rate, a)))
    };
    let mut driven = 0;
    for microsteps in [1, 2, 4, 8, 16] {
        for first in corners(microsteps) {
            for second in corners(microsteps) {
                for (mean, travel) in
                    [0, 1, 400].into_iter().flat_map(|mean| [0, 1, WIDEST].map(|t| (mean, t)))
                {
                    let motor = |(rate, acceleration)| Motor {
                        max_rate: Rate(rate),
                        travel_min: Steps16(-travel),
                        travel_max: Steps16(travel),
                        ..widest_motor(acceleration)
                    };
                    let motors = [motor(first), motor(second), motor(first)];
                    drive(&Config {
                        motors: motors.into(),
                        microsteps,
                        mean: Milliseconds(mean),
                        ..config()
                    });
                    driven += 1;
                }
            }
        }
    }
    assert_eq!(driven, 5 * 36 * 9);
}
