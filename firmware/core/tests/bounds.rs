//! Both ends of every field of a configuration, with extreme positions, ages and clocks, in all
//! combinations of four: no step of the arithmetic overflows, and the motors' limits hold.
//!
//! An overflow panics in this build. The fields have over 10^9 combinations of their ends; the rows
//! here contain every combination of any four of them (a covering array of strength 4), which the
//! test counts.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

mod common;

use std::collections::BTreeSet;

use common::bench::Bench;
use common::covering::rows_of_four;
use common::{BUILD, config};
use plumb_core::BuildLimits;
use plumb_core::driver_timing::DriverTiming;
use plumb_protocol::Config;
use plumb_protocol::config::*;
use plumb_protocol::message::{Command, Hello, Jog, Position, State};
use plumb_protocol::units::*;

/// Limits of a build as fast as the planner allows.
const FASTEST: BuildLimits = BuildLimits { max_pulse_rate: 1_250_000, ..BUILD };
/// Largest |coordinate|, µm.
const FAR: i32 = 4_000_000;
/// Widest travel, 1/16 steps.
const WIDEST: i32 = 1 << 29;

/// A configuration and what happens under it.
struct Case {
    config: Config,
    /// Clock of the board at the start, µs.
    start: u64,
    /// Number before that of the first position; they wrap.
    sequence: u16,
    /// Age of the positions, µs.
    age_us: u32,
    covariance: Option<Covariance>,
    /// States in which a motor turned.
    moved: BTreeSet<&'static str>,
}

/// Sets one field to one of its ends.
type Setter = fn(&mut Case);

/// Returns the fields, each with its ends. A field comes after those that its ends depend on.
fn fields() -> Vec<&'static [Setter]> {
    vec![
        &[
            |c| c.config.law = interval([1, 1], 1),
            |c| c.config.law = interval([1, 8 << 16], 16 << 16),
            |c| c.config.law = interval([8 << 16, 8 << 16], 16 << 16),
            |c| c.config.law = Law::Sign(Sign { gain: SignGain(1) }),
            |c| c.config.law = Law::Sign(Sign { gain: SignGain(1 << 20) }),
            |c| c.config.law = Law::Adaptive(Estimated { delay: Milliseconds(0) }),
            |c| c.config.law = Law::Adaptive(Estimated { delay: Milliseconds(500) }),
            |c| c.config.law = Law::Taut(Estimated { delay: Milliseconds(0) }),
            |c| c.config.law = Law::Taut(Estimated { delay: Milliseconds(500) }),
        ],
        &[
            |c| c.config.drivers = step_dir(0, 0, 0),
            |c| c.config.drivers = step_dir(4_100, u16::MAX, u16::MAX),
            |c| c.config.drivers = Drivers::Coils(Coils { duty_percent: 1 }),
            |c| c.config.drivers = Drivers::MotorHats(Coils { duty_percent: 100 }),
        ],
        &[|c| c.config.microsteps = 1, |c| c.config.microsteps = 16],
        // One motor at the other end than the two others shows what they share.
        &[
            |c| set_rates(c, [1, 1, 1]),
            |c| set_rates(c, [i32::MAX, 1, i32::MAX]),
            |c| set_rates(c, [i32::MAX; 3]),
        ],
        &[
            |c| c.config.motors.iter_mut().for_each(|m| m.max_acceleration = Acceleration(40)),
            |c| c.config.motors[1].max_acceleration = Acceleration(4_000_000),
            |c| {
                c.config
                    .motors
                    .iter_mut()
                    .for_each(|m| m.max_acceleration = Acceleration(4_000_000))
            },
        ],
        &[
            |c| set_travel(c, [0, 0]),
            |c| set_travel(c, [-WIDEST, 0]),
            |c| set_travel(c, [-WIDEST, WIDEST]),
        ],
        &[|c| c.config.motors[0].reversed = false, |c| c.config.motors[0].reversed = true],
        &[
            |c| set_workspace(c, [-FAR, FAR]),
            |c| set_workspace(c, [FAR - 1, FAR]),
            |c| set_workspace(c, [-FAR, 1 - FAR]),
        ],
        &[
            |c| c.config.reached = Reached { radius: Micrometres(1), frames: 255 },
            |c| c.config.reached = Reached { radius: Micrometres(1_000_000), frames: 1 },
        ],
        &[
            |c| c.config.deadlines.host = Milliseconds(1),
            |c| c.config.deadlines.host = Milliseconds(5_000),
        ],
        &[
            |c| set_position(c, 2, 1),
            |c| set_position(c, 5_000, 1),
            |c| set_position(c, 5_000, 4_999),
        ],
        &[
            |c| c.config.growth = Growth { margin: Micrometres(1), time: Milliseconds(5_000) },
            |c| c.config.growth = Growth { margin: Micrometres(1_000_000), time: Milliseconds(1) },
        ],
        &[
            |c| c.config.following = following(1, 1_000_000),
            |c| c.config.following = following(1_600_000, 5_000),
        ],
        &[
            |c| c.config.progress = progress(1, 60_000),
            |c| c.config.progress = progress(1_000_000, 1),
        ],
        &[
            |c| c.config.jog = JogLimits { max_rate: Rate(1), max_distance: Steps16(2 * WIDEST) },
            |c| c.config.jog = JogLimits { max_rate: Rate(i32::MAX), max_distance: Steps16(1) },
            |c| {
                let (max_rate, max_distance) = (Rate(i32::MAX), Steps16(2 * WIDEST));
                c.config.jog = JogLimits { max_rate, max_distance };
            },
        ],
        &[|c| c.config.mean = Milliseconds(0), |c| c.config.mean = Milliseconds(400)],
        &[|c| c.start = 0, |c| c.start = (1 << 32) - 60_000, |c| c.start = 1 << 62],
        &[|c| c.sequence = 0, |c| c.sequence = u16::MAX - 20],
        &[|c| c.age_us = 0, |c| c.age_us = u32::from(c.config.deadlines.max_age.0) * 1_000],
        &[
            |c| c.covariance = None,
            |c| c.covariance = Some(Covariance { variances: [0; 3], covariances: [0; 3] }),
            |c| {
                let (variances, covariances) = ([u16::MAX; 3], [i16::MIN, i16::MAX, i16::MIN]);
                c.covariance = Some(Covariance { variances, covariances });
            },
        ],
    ]
}

fn interval([alpha, beta]: [u32; 2], gain: u32) -> Law {
    Law::Interval(Interval::uniform(Bound(alpha), Bound(beta), Gain(gain)))
}

fn step_dir(high: u16, low: u16, setup: u16) -> Drivers {
    let [high, low, setup] = [high, low, setup].map(Nanoseconds);
    Drivers::StepDir(StepDir { high, low, setup })
}

/// Sets the highest rates, Q8 steps/s, at most what drivers and build allow.
fn set_rates(case: &mut Case, rates: [i32; 3]) {
    let microsteps = u32::from(case.config.microsteps);
    let pulses = match &case.config.drivers {
        Drivers::StepDir(times) => DriverTiming::new(times).unwrap().max_pulse_rate(),
        Drivers::Coils(_) => 2_500 * microsteps,
        Drivers::MotorHats(_) => 300 * microsteps,
    };
    let pulses = u64::from(pulses.min(FASTEST.max_pulse_rate));
    let fastest = ((pulses << 8) / u64::from(microsteps)) as i32;
    for (motor, rate) in case.config.motors.iter_mut().zip(rates) {
        motor.max_rate = Rate(rate.min(fastest));
    }
}

fn set_travel(case: &mut Case, [min, max]: [i32; 2]) {
    for motor in &mut case.config.motors {
        (motor.travel_min, motor.travel_max) = (Steps16(min), Steps16(max));
    }
}

fn set_workspace(case: &mut Case, [min, max]: [i32; 2]) {
    let [min, max] = [min, max].map(|c| Point([Micrometres(c); 3]));
    case.config.workspace = Workspace { min, max };
}

fn set_position(case: &mut Case, position: u16, max_age: u16) {
    case.config.deadlines.position = Milliseconds(position);
    case.config.deadlines.max_age = Milliseconds(max_age);
}

fn following(turn: i32, movement: i32) -> Following {
    Following { turn: Steps16(turn), movement: Micrometres(movement) }
}

fn progress(margin: i32, time: u16) -> Progress {
    Progress { margin: Micrometres(margin), time: Milliseconds(time) }
}

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
        let state = bench.board.state();
        bench.tick();
        if bench.moving() {
            case.moved.insert(name(state));
        }
        let (rates, at) = (bench.board.rates(), bench.board.travel_positions());
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
        let at = bench.board.travel_positions()[usize::from(motor)];
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
        let (start, sequence, age_us, covariance) = (0, 0, 0, None);
        let states = BTreeSet::new();
        let mut case =
            Case { config: config(), start, sequence, age_us, covariance, moved: states };
        row.iter().zip(&fields).for_each(|(&end, field)| field[end](&mut case));
        let mut bench = Bench::new(FASTEST);
        (bench.now, bench.sequence) = (case.start, case.sequence);
        assert_eq!(bench.send(Command::Hello(Hello::OURS)), Ok(()));
        let configured = bench.send(Command::Configure(case.config));
        assert_eq!(configured, Ok(()), "every end is accepted: {:?}", case.config);
        drive(&mut bench, &mut case);
        jog(&mut bench, &mut case);
        moved.append(&mut case.moved);
    }
    println!("{} configurations", rows.len());
    let states = ["fault", "holding", "jogging", "seeking", "stopping"];
    assert!(moved.iter().eq(&states), "a motor turned in the states {moved:?}");
}
