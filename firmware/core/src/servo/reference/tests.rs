//! Tests of the reference.

use plumb_protocol::Config;
use plumb_protocol::message::Knot;
use plumb_protocol::units::{Milliseconds, Speed};
use plumb_protocol::wiring::{Drivers, StepDir};

use super::*;
use crate::law::LawTicks;
use crate::params::BuildLimits;

/// Returns limits with a moving average of 400 ms.
fn params() -> Params {
    let config = Config { mean: Milliseconds(400), ..Config::example() };
    let build = BuildLimits {
        max_pulse_rate: 1_000_000,
        storage: false,
        chip: None,
        law_ticks: LawTicks::RP2040,
    };
    Params::check(&config, &Drivers::StepDir(StepDir::TMC2209), &build).unwrap()
}

/// Returns a line from zero along x with `speed`, µm/s, and knots every 0.5 s.
fn line(speed: i32) -> message::Reference {
    let knot = |k: usize| Knot {
        position: Point([speed / 2 * k as i32, 0, 0].map(Micrometres)),
        velocity: [speed, 0, 0].map(Speed),
    };
    message::Reference {
        sequence: 0,
        now: Micros(0),
        waits: true,
        first: Micros(0),
        interval_us: 500_000,
        knots: core::array::from_fn(knot),
    }
}

/// Returns a reference after 1.6 s along a line with `speed`, µm/s.
fn reference(speed: i32, params: &Params) -> ReferenceTracker {
    let mut reference = ReferenceTracker::new(Micros(0), [7, 0, 0], &line(speed));
    assert_eq!(reference.smoothed(), Point([7, 0, 0].map(Micrometres)));
    // 100 states in three parts.
    for step in 0..300 {
        reference.step(Micros(5_000 * step), Some(0), params);
    }
    reference
}

#[test]
fn the_room_of_the_motors_is_a_share_of_the_present_pace() {
    let mut reference = reference(50_000, &params());
    let mut with_room = |room| {
        reference.set_room(room);
        reference.law_pace
    };
    assert_eq!(with_room(128), 0.5);
    assert_eq!(with_room(0), 0.5);
    assert_eq!(with_room(1), MIN_LAW_PACE);
    assert_eq!(with_room(1000), 1.0);
}

#[test]
fn the_aim_of_a_law_is_half_of_the_moving_average_ahead_with_the_speed_there() {
    let params = params();
    for speed in [50_000, -50_000] {
        let reference = reference(speed, &params);
        let aim = reference.aim(Micros(1_000_000), &params);
        // And one and a half cells of the average, 3.2 ms each.
        assert_eq!(aim.position, reference.position(Micros(1_204_800)));
        assert_ne!(aim.position, reference.position(Micros(1_000_000)));
        assert!((aim.velocity[0] - speed).abs() < 100 && aim.velocity[1] == 0, "{aim:?}");
        // A law that does not use the velocity aims at the same place.
        let place = reference.place(Micros(1_000_000), &params);
        assert_eq!(place, Aim { position: aim.position, velocity: [0; 3] });
    }
}

#[test]
fn a_reference_speeds_up_with_the_acceleration_of_its_pace() {
    let params = params();
    let mut reference = ReferenceTracker::new(Micros(0), [0; 3], &line(50_000));
    (0..2).for_each(|_| reference.step(Micros(0), Some(0), &params));
    let Work::Leader { motion, .. } = reference.work else { panic!("{:?}", reference.work) };
    // The pace changes by 250 mm/s² over the path's 50 mm/s: 5 a second.
    assert!((motion.acceleration[0] - 250.0).abs() < 0.1, "{motion:?}");
    assert_eq!(motion.velocity, [0.0; 3]);
}

#[test]
fn a_state_is_made_in_any_tick_once_it_is_four_milliseconds_late() {
    let reference = reference(50_000, &params());
    let due = reference.next_step(0);
    assert!(!reference.is_late(due, 0));
    assert!(!reference.is_late(Micros(due.0 + 4_000), 0));
    assert!(reference.is_late(Micros(due.0 + 4_001), 0));
}

#[test]
fn the_last_place_of_a_path_is_its_last_knot() {
    let reference = ReferenceTracker::new(Micros(0), [0; 3], &line(50_000));
    assert_eq!(reference.last(), Point([125_000, 0, 0].map(Micrometres)));
}

#[test]
fn a_part_is_that_of_exact_arithmetic() {
    for value in [0, 1, -1, 0xffff, -0x10000, 0x1_2345, -0x765_4321, i32::MAX, i32::MIN] {
        for share in [0, 1, 0x8000, 0xabcd, 0xffff] {
            let exact = (i64::from(value) * i64::from(share)) >> 16;
            assert_eq!(i64::from(part_of(value, share)), exact, "{value} {share}");
        }
    }
}

#[test]
fn a_track_is_linear_between_its_states_and_rests_beyond_them() {
    let state = |k: i32| State { position: [1600 * k, 0, -800 * k], time: 1000 * i64::from(k) };
    let begin = 1_000_000;
    let mut track = Track::new(Micros(begin), state(0));
    (1..=40).for_each(|k| track.push(state(k)));
    let end = begin + 40 * u64::from(STEP_US);
    assert_eq!(track.end(), Micros(end));
    let at = |us: u64| {
        let time = Micros(us);
        State { position: track.position(time), time: track.path_time(time) }
    };
    assert_eq!(at(end), state(40));
    assert_eq!(at(u64::MAX), state(40));
    let half = end - u64::from(STEP_US) / 2;
    assert_eq!(at(half), State { position: [63_200, 0, -31_600], time: 39_500 });
    assert_eq!(at(end - 30 * u64::from(STEP_US)), state(10));
    let beyond = end - 31 * u64::from(STEP_US) - u64::from(STEP_US) / 2;
    assert_eq!([at(beyond), at(0)], [state(9); 2]);
}

/// A path that is late beyond its limit jumps back.
#[test]
fn the_time_of_a_path_may_go_back() {
    let state = |time| State { position: [0; 3], time };
    let mut track = Track::new(Micros(0), state(9_000));
    track.push(state(1_000));
    assert_eq!(track.path_time(Micros(u64::from(STEP_US) / 2)), 5_000);
}
