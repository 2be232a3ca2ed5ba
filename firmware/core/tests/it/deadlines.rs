//! Deadlines and guards hold under other traffic: lost and late positions, repeated commands.
#![allow(clippy::unwrap_used, reason = "a test ends at the first error")]

use plumb_core::TICK_US;
use plumb_core::params::Params;
use plumb_protocol::Config;
use plumb_protocol::config::Deadlines;
use plumb_protocol::message::*;
use plumb_protocol::units::{Milliseconds, Point, Rate, Steps16};

use crate::common::bench::{BALL, Bench, TARGET, point};
use crate::common::{BUILD, config, wiring};

fn deadlines(host: u16, position: u16, max_age: u16) -> Deadlines {
    Deadlines {
        host: Milliseconds(host),
        position: Milliseconds(position),
        max_age: Milliseconds(max_age),
    }
}

/// Returns a board that seeks a target with these deadlines.
fn seeking(deadlines: Deadlines) -> Bench {
    let mut bench = Bench::configured(Config { deadlines, ..config() });
    bench.send_ball(BALL);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(20, BALL);
    bench
}

/// Checks that the board stops for lost positions within `most_ms`, while `each` sends what a host
/// sends every `period_ms`.
fn assert_positions_are_lost(
    bench: &mut Bench,
    most_ms: u64,
    period_ms: u64,
    each: impl Fn(&mut Bench),
) {
    let mut gone = 0;
    while bench.harness.board.state() == State::Seeking {
        assert!(gone <= most_ms, "no fresh position for {gone} ms, and no stop");
        each(bench);
        bench.run_ms(period_ms);
        gone += period_ms;
    }
    assert_eq!(bench.harness.board.state(), State::Fault(Fault::PositionLost));
}

#[test]
fn a_highest_age_at_the_position_deadline_or_above_is_refused() {
    for (position, max_age, accepted) in [(500, 499, true), (500, 500, false), (500, 5000, false)] {
        let config = Config { deadlines: deadlines(300, position, max_age), ..config() };
        let expected = if accepted { Ok(()) } else { Err(ConfigField::MaxAge) };
        assert_eq!(
            Params::check(&config, &wiring().drivers, &BUILD).map(drop),
            expected,
            "{position} {max_age}"
        );
    }
}

#[test]
fn one_old_position_and_a_heartbeat_stop_the_board() {
    let mut bench = seeking(deadlines(300, 500, 499));
    let _ = bench.send_position(Some(BALL), 498_000);
    assert_positions_are_lost(&mut bench, 60, 30, |bench| {
        assert_eq!(bench.send(Command::Status), Ok(()));
    });
}

/// Each position is nearly as old as the deadline, and comes just before the last one is too old.
#[test]
fn positions_that_grow_older_stop_the_board() {
    let mut bench = seeking(deadlines(300, 100, 99));
    let _ = bench.send_position(Some(BALL), 95_000);
    assert_positions_are_lost(&mut bench, 50, 2, |bench| {
        let _ = bench.send_position(Some(BALL), 99_000);
        let _ = bench.send(Command::Status);
    });
}

#[test]
fn targets_without_positions_stop_the_board() {
    for period_ms in [1, 5, 33] {
        let mut bench = seeking(deadlines(300, 500, 250));
        assert_positions_are_lost(&mut bench, 600, period_ms, |bench| {
            assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
        });
    }
}

#[test]
fn telemetry_comes_every_100_ms_whatever_is_refused() {
    // The Hello comes long after the start, so that telemetry is overdue at once.
    let mut bench = Bench::new(BUILD);
    bench.run_ms(1000);
    let _ = bench.send(Command::Hello(Hello::OURS));
    let mut last = bench.now;
    for k in 0..20_000u32 {
        if k % 7 == 0 {
            bench.send_ball(BALL);
        }
        bench.received.clear();
        bench.tick();
        if bench.received.iter().any(|m| matches!(m, FromBoard::Telemetry(_))) {
            last = bench.now;
        }
        assert!(bench.now - last <= 100_000 + u64::from(TICK_US), "{} µs", bench.now - last);
    }
}

/// The ball moves away while its target moves a little with every position.
#[test]
fn targets_that_come_often_do_not_disarm_the_divergence_guard() {
    let mut bench = Bench::seeking();
    for step in 0..120 {
        let away = f64::from(step) * 0.005;
        let ball = [BALL[0] + away, BALL[1], BALL[2]];
        let angle = f64::from(step) * 0.1;
        let target = [TARGET[0] + 0.05 * angle.cos(), TARGET[1] + 0.05 * angle.sin(), TARGET[2]];
        let _ = bench.send(Command::Target(point(target)));
        bench.run_with_ball(1, ball);
    }
    assert_eq!(bench.faults(), [Fault::ErrorGrowing]);
}

#[test]
fn stops_between_targets_do_not_disarm_the_divergence_guard() {
    let mut bench = Bench::seeking();
    for step in 0..120 {
        let ball = [BALL[0] + f64::from(step) * 0.005, BALL[1], BALL[2]];
        bench.run_with_ball(1, ball);
        let _ = bench.send(Command::Stop);
        let _ = bench.send(Command::Target(point(TARGET)));
    }
    assert_eq!(bench.faults(), [Fault::ErrorGrowing]);
}

#[test]
fn a_drive_that_follows_a_jog_begins_with_new_guards() {
    let mut bench = Bench::seeking();
    bench.run_with_ball(60, TARGET);
    let away = [TARGET[0] + 0.2, TARGET[1], TARGET[2]];
    bench.run_with_ball(8, away);
    assert_eq!(bench.send(Command::Stop), Ok(()));
    bench.run_with_ball(60, away);
    let jog = Jog { motor: 0, distance: Steps16(16 * 20), rate: Rate(256 * 100) };
    assert_eq!(bench.send(Command::Jog(jog)), Ok(()));
    bench.run_with_ball(2, away);
    // The motor still turns when the next target comes.
    assert_eq!(bench.send(Command::Stop), Ok(()));
    assert!(bench.moving());
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(3, away);
    assert_eq!(bench.faults(), []);
}

#[test]
fn a_target_far_away_is_no_divergence() {
    let mut bench = Bench::seeking();
    let far: [Point; 2] = [[-0.9, -0.9, -0.9], [1.9, 1.9, 0.5]].map(point);
    for target in far.into_iter().cycle().take(6) {
        assert_eq!(bench.send(Command::Target(target)), Ok(()));
        bench.run_with_ball(30, BALL);
        assert_eq!(bench.harness.board.state(), State::Seeking);
    }
}

/// A person moves the ball by hand while the motors stand.
#[test]
fn a_ball_moved_by_hand_at_standstill_is_no_divergence() {
    let mut bench = Bench::seeking();
    bench.run_with_ball(60, TARGET);
    assert_eq!(bench.send(Command::Stop), Ok(()));
    bench.run_with_ball(20, [TARGET[0] + 0.4, TARGET[1], TARGET[2]]);
    assert_eq!(bench.send(Command::Target(point(TARGET))), Ok(()));
    bench.run_with_ball(30, [TARGET[0] + 0.4, TARGET[1], TARGET[2]]);
    assert_eq!(bench.harness.board.state(), State::Seeking);
}

/// Time from the last position of a board that seeks to the tick in which `ends` is true, µs.
fn time_until(deadlines: Deadlines, ends: impl Fn(&Bench) -> bool) -> u64 {
    let mut bench = seeking(deadlines);
    bench.send_ball(BALL);
    let last = bench.now;
    loop {
        let tick = bench.now;
        assert!(tick - last < 6_000_000, "no end");
        bench.tick();
        if ends(&bench) {
            return tick - last;
        }
    }
}

/// A deadline that ends with a tick expires in the next one, and no later.
#[test]
fn deadlines_expire_with_the_first_tick_after_them() {
    const TICK: u64 = TICK_US as u64;
    /// Age of the positions, µs.
    const AGE: u64 = 30_000;
    let has = |fault| move |bench: &Bench| bench.faults() == [fault];
    let silent = time_until(deadlines(300, 5_000, 250), has(Fault::HostSilent));
    assert_eq!(silent, 300_000 + TICK);
    let lost = time_until(deadlines(5_000, 500, 250), has(Fault::PositionLost));
    assert_eq!(lost, 500_000 - AGE + TICK);
}

/// The rates fall after two fifths of the position deadline, and not with a later check.
#[test]
fn rates_are_reduced_with_the_first_tick_after_two_fifths_of_the_position_deadline() {
    let fastest = {
        let bench = seeking(deadlines(5_000, 500, 250));
        bench.harness.board.rates()
    };
    let reduced =
        time_until(deadlines(5_000, 500, 250), |bench| bench.harness.board.rates() != fastest);
    assert_eq!(reduced, 200_000 - 30_000 + u64::from(TICK_US));
}
