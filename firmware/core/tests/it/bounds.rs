//! Both ends of every field of a configuration, with extreme positions, ages and clocks, in all
//! combinations of four: no step of the arithmetic overflows, and the motors' limits hold.
//!
//! An overflow panics in this build. The fields have over 10^9 combinations of their ends; the rows
//! here contain every combination of any four of them (a covering array of strength 4), which the
//! test counts.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

mod fields;

use std::collections::BTreeSet;

use plumb_core::BuildLimits;
use plumb_protocol::Wiring;
use plumb_protocol::message::{Command, Hello, Jog, Knot, Position, Reference, State};
use plumb_protocol::units::*;

use crate::common::BUILD;
use crate::common::bench::Bench;
use crate::common::covering::rows_of_four;
use fields::{Case, fields};

/// Limits of a build as fast as the planner allows.
const FASTEST: BuildLimits = BuildLimits { max_pulse_rate: 1_250_000, ..BUILD };

/// Returns the name of a state, one for all faults.
fn name(state: State) -> &'static str {
    match state {
        State::Unconfigured => "unconfigured",
        State::Ready => "ready",
        State::Jogging => "jogging",
        State::Seeking => "seeking",
        State::Holding => "holding",
        State::Following => "following",
        State::Stopping => "stopping",
        State::Storing => "storing",
        State::Fault(_) => "fault",
    }
}

/// Runs `ticks` ticks. Rates and travel must hold in each.
fn run(bench: &mut Bench, case: &mut Case, ticks: usize) {
    for _ in 0..ticks {
        let state = bench.harness.board.state();
        bench.tick();
        if bench.moving() {
            case.moved.insert(name(state));
        }
        let (rates, at) = (bench.harness.board.rates(), bench.harness.board.travel_positions());
        for (k, motor) in case.config.motors.iter().enumerate() {
            assert!(rates[k].abs() <= motor.max_rate.0, "{rates:?}");
            assert!((motor.travel_min.0..=motor.travel_max.0).contains(&at[k]), "{at:?}");
        }
    }
    bench.received.clear();
}

fn send_position(bench: &mut Bench, case: &mut Case, ball: [i32; 3], age_us: u32) {
    bench.sequence = bench.sequence.wrapping_add(1);
    let (sequence, covariance) = (bench.sequence, case.covariance);
    let ball = Some(Point(ball.map(Micrometres)));
    let _ = bench.send(Command::Position(Position { sequence, age_us, ball, covariance }));
}

/// Drives to each corner of the workspace while the ball is seen at each other one, and outside.
fn drive(bench: &mut Bench, case: &mut Case) {
    let [min, max] =
        [case.config.workspace.min, case.config.workspace.max].map(|p| p.micrometres()[0]);
    let corners = [[min; 3], [max; 3], [min, max, min], [max, min, max]];
    for target in corners {
        send_position(bench, case, [min; 3], 0);
        let _ = bench.send(Command::Target(Point(target.map(Micrometres))));
        for ball in corners.iter().cycle().take(12) {
            send_position(bench, case, *ball, case.age_us);
            run(bench, case, 4);
        }
        follow(bench, case, corners);
        let _ = bench.send(Command::Hold);
        for _ in 0..10 {
            send_position(bench, case, target, case.age_us);
            run(bench, case, 3);
        }
        send_position(bench, case, [i32::MIN, i32::MAX, i32::MIN], u32::MAX);
        for _ in 0..3 {
            send_position(bench, case, [i32::MIN, i32::MAX, i32::MIN], 0);
        }
        stand(bench, case);
    }
}

/// Follows paths through the corners of the workspace, with jumps between them.
fn follow(bench: &mut Bench, case: &mut Case, corners: [[i32; 3]; 4]) {
    for part in 0..6_u16 {
        let knots = std::array::from_fn(|k| {
            let sign = if (k + usize::from(part)).is_multiple_of(2) { 1 } else { -1 };
            let position = Point(corners[k % 4].map(Micrometres));
            Knot { position, velocity: [Speed(sign * case.speed); 3] }
        });
        let [first, now] = case.path_start;
        let interval_us = case.interval_us;
        let now = Micros(now.saturating_add(u64::from(part) * u64::from(interval_us)));
        let first = Micros(first);
        let (sequence, waits) = (u16::MAX.wrapping_add(part), part % 2 == 0);
        let reference = Reference { sequence, now, waits, first, interval_us, knots };
        let _ = bench.send(Command::Follow(reference));
        for ball in corners {
            send_position(bench, case, ball, case.age_us);
            run(bench, case, 6);
        }
    }
}

/// Stops the motors, and clears a fault.
fn stand(bench: &mut Bench, case: &mut Case) {
    let _ = bench.send(Command::Stop);
    // A motor at the slowest acceleration may turn for longer; then the fault stays.
    for _ in 0..100 {
        run(bench, case, 8);
        if !bench.moving() {
            break;
        }
    }
    let _ = bench.send(Command::ClearFault);
}

/// Jogs each motor as far as it may go, to either side, and makes that its zero.
fn jog(bench: &mut Bench, case: &mut Case) {
    for motor in 0..3_u8 {
        let limits = case.config.motors[usize::from(motor)];
        let at = bench.harness.board.travel_positions()[usize::from(motor)];
        let farthest = case.config.jog.max_distance.0;
        for end in [limits.travel_max.0, limits.travel_min.0] {
            let distance = Steps16((end - at).clamp(-farthest, farthest));
            let rate = limits.max_rate.min(case.config.jog.max_rate);
            let _ = bench.send(Command::Jog(Jog { motor, distance, rate }));
            run(bench, case, 40);
            let _ = bench.send(Command::Jog(Jog { motor, distance: Steps16(i32::MIN), rate }));
            stand(bench, case);
        }
        let _ = bench.send(Command::Home);
    }
}

#[test]
fn no_accepted_configuration_overflows_at_the_ends_of_any_four_fields() {
    let fields = fields();
    let ends: Vec<usize> = fields.iter().map(|field| field.len()).collect();
    let (rows, mut moved) = (rows_of_four(&ends), BTreeSet::new());
    for row in &rows {
        let mut case = Case::new();
        row.iter().zip(&fields).for_each(|(&end, field)| field[end](&mut case));
        let mut bench = Bench::new(FASTEST);
        (bench.now, bench.sequence) = (case.start, case.sequence);
        assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
        assert_eq!(bench.send(Command::Wire(Wiring::pico(case.drivers))), Ok(()));
        let configured = bench.send(Command::Configure(case.config));
        assert_eq!(configured, Ok(()), "every end is accepted: {:?}", case.config);
        drive(&mut bench, &mut case);
        jog(&mut bench, &mut case);
        moved.append(&mut case.moved);
    }
    println!("{} configurations", rows.len());
    let states = ["fault", "following", "holding", "jogging", "seeking", "stopping"];
    assert!(moved.iter().eq(&states), "a motor turned in the states {moved:?}");
}
