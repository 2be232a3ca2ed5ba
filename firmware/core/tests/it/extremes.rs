//! The ends of the accepted ranges. An overflow panics in this build.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::params::Params;
use plumb_core::plan::{Planner, RunOut};
use plumb_core::servo::{DriveState, Guards, MotorsOfDrive};
use plumb_core::{BuildLimits, MotorRates};
use plumb_protocol::Config;
use plumb_protocol::config::{Growth, Motor, Progress};
use plumb_protocol::message::*;
use plumb_protocol::units::{
    Acceleration, Micrometres, Micros, Milliseconds, Point, Rate, Steps16,
};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{self, BUILD, config, motor, wiring};

/// Highest pulse rate of the firmware's step generator, 1/s.
const PULSES: i32 = 1_250_000;

/// The widest travel, and one that the fastest motors pass in a second, 1/16 steps.
const TRAVELS: [i32; 2] = [1 << 29, 1 << 20];

/// Returns a planner and its motors' highest rate, Q8 steps/s.
fn planner(microsteps: u8, acceleration: u32, mean: u16, travel: i32) -> (Planner, i32) {
    let fastest = PULSES / i32::from(microsteps) * 256;
    let motor = Motor {
        max_rate: Rate(fastest),
        max_acceleration: Acceleration(acceleration),
        travel_min: Steps16(-travel),
        travel_max: Steps16(travel),
        ..motor(1.0, 40, 0)
    };
    let config =
        Config { motors: [motor; 3].into(), microsteps, mean: Milliseconds(mean), ..config() };
    let mut planner = Planner::default();
    planner.configure(
        &Params::check(
            &config,
            &wiring().drivers,
            &BuildLimits { max_pulse_rate: PULSES as u32, ..BUILD },
        )
        .unwrap(),
    );
    (planner, fastest)
}

#[test]
fn the_fastest_motors_at_the_ends_of_every_range_stay_within_their_travel() {
    for microsteps in [1, 2, 16] {
        for acceleration in [40, 41, 4_000_000] {
            for (mean, travel) in
                [0, 4, 7, 400].into_iter().flat_map(|mean| TRAVELS.map(|t| (mean, t)))
            {
                let (mut planner, fastest) = planner(microsteps, acceleration, mean, travel);
                // Two motors turn for a while and back at once; the third turns to and fro.
                for tick in 0..120_000 {
                    let way = if tick % 50_000 < 30_000 { fastest } else { -fastest };
                    let swing = if tick / 17 % 2 == 0 { fastest } else { -fastest };
                    planner.set_rates(MotorRates([way, -way, swing]), 0);
                    planner.tick();
                    assert!(planner.positions().iter().all(|at| (-travel..=travel).contains(at)));
                }
            }
        }
    }
}

#[test]
fn the_guards_accept_the_farthest_positions() {
    const FAR: i32 = 4_000_000;
    let there = Point([Micrometres(FAR); 3]);
    let motors = |at: i32| MotorsOfDrive { present: [at; 3], at_capture: [at; 3] };
    let near = DriveState::new(Micros(0), [FAR; 3], there, motors(i32::MIN / 2));
    let far = DriveState::new(Micros(1), [-FAR; 3], there, motors(i32::MAX / 2));
    let params = common::params(Config {
        growth: Growth { margin: Micrometres(1_000_000), time: Milliseconds(5_000) },
        progress: Progress { margin: Micrometres(1_000_000), time: Milliseconds(60_000) },
        ..config()
    });
    let mut guards = Guards::default();
    assert_eq!(guards.update(Micros(0), &near, &params), None);
    assert_eq!(guards.update(Micros(1), &far, &params), None);
    let turned = DriveState { motors: near.motors, ..far };
    assert_eq!(guards.update(Micros(2), &turned, &params), Some(Fault::NotFollowing));
    assert_eq!(guards.update(Micros(u64::MAX), &far, &params), Some(Fault::ErrorGrowing));
    // The longest run-out.
    let mut guards = Guards::default();
    assert_eq!(guards.update(Micros(0), &near, &params), None);
    let run_out = RunOut { motors: [i32::MAX / 2; 3], time_us: 2_000 };
    guards.note_change(Micros(0), [-2 * FAR; 3], &run_out);
    let rests = DriveState { motors: near.motors, ..far };
    assert_eq!(guards.update(Micros(1), &rests, &params), None);
    assert_eq!(guards.update(Micros(u64::MAX), &rests, &params), Some(Fault::ErrorGrowing));
}

#[test]
fn a_clock_of_more_than_32_bits_keeps_the_deadlines() {
    for start in [(1 << 32) - 600_000, (1 << 40) + 7, 1 << 52] {
        let mut bench = Bench::new(BUILD);
        bench.now = start;
        bench.greet();
        assert_eq!(bench.send(Command::Configure(config())), Ok(()));
        bench.send_ball(BALL);
        assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
        bench.run_with_ball(30, BALL);
        assert_eq!((bench.harness.board.state(), bench.faults().len()), (State::Seeking, 0));
        let last = bench.now;
        while bench.faults().is_empty() {
            bench.tick();
        }
        assert_eq!(bench.faults(), [Fault::HostSilent]);
        assert!((200_000..400_000).contains(&(bench.now - last)), "{} µs", bench.now - last);
    }
}
