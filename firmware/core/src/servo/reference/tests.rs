//! Tests of the reference.

use plumb_protocol::Config;
use plumb_protocol::message::Knot;
use plumb_protocol::units::{Milliseconds, Speed};

use super::*;
use crate::params::BuildLimits;

/// Returns limits with a moving average of 400 ms.
fn params() -> Params {
    let config = Config { mean: Milliseconds(400), ..Config::example() };
    Params::check(&config, &BuildLimits { max_pulse_rate: 1_000_000, storage: false }).unwrap()
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
fn follower(speed: i32, params: &Params) -> Follower {
    let mut follower = Follower::new(Micros(0), [7, 0, 0], &line(speed));
    assert_eq!(follower.smoothed(), Point([7, 0, 0].map(Micrometres)));
    // 100 states in three parts.
    for step in 0..300 {
        follower.step(Micros(5_000 * step), Some(0), params);
    }
    follower
}

#[test]
fn the_room_of_the_motors_is_a_share_of_the_present_pace() {
    let mut follower = follower(50_000, &params());
    let mut with_room = |room| {
        follower.set_room(room);
        follower.law_pace
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
        let follower = follower(speed, &params);
        let aim = follower.aim(Micros(1_000_000), &params);
        // And one and a half cells of the average, 3.2 ms each.
        assert_eq!(aim.position, follower.position(Micros(1_204_800)));
        assert_ne!(aim.position, follower.position(Micros(1_000_000)));
        assert!((aim.velocity[0] - speed).abs() < 100 && aim.velocity[1] == 0, "{aim:?}");
        // A law that does not use the velocity aims at the same place.
        let place = follower.place(Micros(1_000_000), &params);
        assert_eq!(place, Aim { position: aim.position, velocity: [0; 3] });
    }
}

#[test]
fn a_reference_speeds_up_with_the_acceleration_of_its_pace() {
    let params = params();
    let mut follower = Follower::new(Micros(0), [0; 3], &line(50_000));
    (0..2).for_each(|_| follower.step(Micros(0), Some(0), &params));
    let Work::Leader { motion, .. } = follower.work else { panic!("{:?}", follower.work) };
    // The pace changes by 250 mm/s² over the path's 50 mm/s: 5 a second.
    assert!((motion.acceleration[0] - 250.0).abs() < 0.1, "{motion:?}");
    assert_eq!(motion.velocity, [0.0; 3]);
}

#[test]
fn a_state_is_made_in_any_tick_once_it_is_four_milliseconds_late() {
    let follower = follower(50_000, &params());
    let due = follower.next_step(0);
    assert!(!follower.is_late(due, 0));
    assert!(!follower.is_late(Micros(due.0 + 4_000), 0));
    assert!(follower.is_late(Micros(due.0 + 4_001), 0));
}

#[test]
fn the_last_place_of_a_path_is_its_last_knot() {
    let follower = Follower::new(Micros(0), [0; 3], &line(50_000));
    assert_eq!(follower.last(), Point([125_000, 0, 0].map(Micrometres)));
}
