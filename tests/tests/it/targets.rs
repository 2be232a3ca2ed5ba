//! Targets that move, in virtual time: lines of JSON from a sender through the real intake, control
//! loop and link. How well the ball follows at different rates, over good links and poor ones, when
//! lines are late, out of order or cease, and when the target jumps or leaves the workspace.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod run;
mod sender;

use nalgebra::{Point3, Vector3};
use plumb_protocol::message::State;
use plumb_runtime::observer::{FrameRecord, TargetsEvent};
use plumb_runtime::operator::OperatorCommand;
use plumb_runtime::rig::LawName;
use plumb_runtime::run::{StopReason, TargetUse};
use plumb_tests::links::link;

use run::TargetRun;
use sender::{Sender, Two, jitter};

/// Centre of the motions, metres: the middle of the paper's workspace.
const CENTRE: Point3<f64> = Point3::new(0.45, 0.30, 0.325);

/// Circle of 5 cm at 5 cm/s.
fn circle(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(time.cos(), time.sin(), 0.0) * 0.05
}

#[test]
fn the_ball_follows_targets_that_come_late_and_out_of_order_over_every_link() {
    let names = ["ideal", "115200 baud", "2 ms", "10 % lost", "latency 20 ms", "poor radio"];
    for rate in [30.0, 200.0] {
        for name in names {
            let run = TargetRun { link: link(name), ..TargetRun::default() };
            let outcome = run.drive(Sender::new(circle, rate, [0.5, 10.0], jitter(1)));
            outcome.check_reached(name);
            let targets = outcome.targets();
            let spreads = targets.spreads.unwrap();
            assert!(spreads.error.rms_mm <= 2.0, "{name}, {rate} Hz: {targets:?}");
            assert!(targets.left_out.out_of_order > 5, "{name}, {rate} Hz: {targets:?}");
            assert!(!outcome.has(&TargetsEvent::Lagging), "{name}, {rate} Hz");
            let (frames, near) = (spreads.frames, targets.near);
            assert!(near > 200 && near <= targets.followed, "{name}, {rate} Hz: {targets:?}");
            assert!(frames >= near.saturating_sub(10), "{name}, {rate} Hz: {targets:?}");
            let farthest = outcome.farthest(circle, 4.0, 9.9);
            assert!(farthest <= 0.006, "{name}, {rate} Hz: {farthest} m");
        }
    }
}

/// What the board tells of the ball is older than 0.3 s.
#[test]
fn the_ball_follows_targets_over_a_slow_link() {
    let run =
        TargetRun { law: LawName::Taut, link: link("latency 150 ms"), ..TargetRun::default() };
    let outcome = run.drive(Sender::new(circle, 30.0, [0.5, 10.0], jitter(4)));
    outcome.check_reached("latency 150 ms");
    let targets = outcome.targets();
    assert!(targets.followed > 200, "{targets:?}");
}

#[test]
fn the_default_law_follows_too() {
    let run = TargetRun { law: LawName::Taut, ..TargetRun::default() };
    let outcome = run.drive(Sender::new(circle, 30.0, [0.5, 10.0], jitter(2)));
    outcome.check_reached("taut");
    assert!(outcome.farthest(circle, 5.0, 9.9) <= 0.010, "{:?}", outcome.targets());
}

#[test]
fn targets_that_cease_let_the_ball_rest_and_it_goes_on_when_they_come_again() {
    let before = (0..).map(|k| 0.5 + f64::from(k) / 30.0).take_while(|time| *time < 5.0);
    let after = (0..).map(|k| 9.0 + f64::from(k) / 30.0).take_while(|time| *time < 14.0);
    let sender = Sender::of(before.chain(after), circle, |_| 0.01);
    let outcome = TargetRun::default().drive(sender);
    outcome.check_reached("ceased");
    let rested = |record: &&FrameRecord| (6.5..8.9).contains(&record.time);
    let places = outcome.records.iter().filter(rested).map(|it| it.position().unwrap());
    let places: Vec<Point3<f64>> = places.collect();
    // The target goes on for 0.4 s and comes to rest within another 0.4 s: 3 cm.
    let rest = circle(5.0 + 0.6);
    let farthest = places.iter().map(|place| (place - rest).norm()).fold(0.0, f64::max);
    assert!(places.len() > 60 && farthest < 0.006, "{farthest}");
    let holds = |record: &FrameRecord| record.board.unwrap().state == State::Holding;
    assert!(outcome.records.iter().filter(rested).any(holds));
    assert!(outcome.has(&TargetsEvent::Ceased) && outcome.has(&TargetsEvent::Resumed));
    assert_eq!(outcome.targets().pauses, 1);
    assert!(outcome.farthest(circle, 12.0, 13.9) < 0.005);
    let (speed, acceleration) = outcome.largest_of_reference();
    assert!(speed <= 0.3 && acceleration <= 1.1, "{speed} m/s, {acceleration} m/s²");
}

/// The board holds the ball at the target for nearly all of the time.
#[test]
fn a_ball_that_is_held_at_a_target_that_rests_has_caught_up() {
    let sender = Sender::new(|_| CENTRE, 30.0, [1.0, 14.0], jitter(3));
    let outcome = TargetRun::default().drive(sender);
    outcome.check_reached("at rest");
    let targets = outcome.targets();
    assert!(targets.near > 200 && targets.spreads.is_some(), "{targets:?}");
    let before = outcome.records.iter().filter(|record| record.time < 0.8);
    let mut before = before.map(|record| (record.target, record.error()));
    assert!(before.all(|it| it == (None, None)), "no target is known before the first one");
}

/// A target that rests, and is 15 mm further in its last line.
fn last_step(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(0.0, if time < 8.0 { 0.0 } else { 0.015 }, 0.0)
}

#[test]
fn the_last_place_is_reached_by_the_ball_and_not_by_the_place_before_it() {
    for name in ["ideal", "latency 20 ms", "10 % lost"] {
        let run = TargetRun { link: link(name), ..TargetRun::default() };
        let outcome = run.drive(Sender::of([0.5, 8.0].into_iter(), last_step, |_| 0.01));
        outcome.check_reached(name);
        let last = outcome.records.last().unwrap().position().unwrap();
        // The radius within which a target is reached is 10 mm.
        let distance = (last - last_step(8.0)).norm();
        assert!(distance <= 0.0105, "{name}: {distance}");
    }
}

/// A target that rests and jumps by 20 cm.
fn jump(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(0.0, if time < 4.0 { -0.1 } else { 0.1 }, 0.0)
}

#[test]
fn the_ball_follows_a_jump_within_the_limits_of_the_rig_file() {
    for (law, rate) in [
        (LawName::Adaptive, 30.0),
        (LawName::Adaptive, 200.0),
        (LawName::Taut, 30.0),
        (LawName::Taut, 200.0),
    ] {
        let run = TargetRun { law, ..TargetRun::default() };
        let outcome = run.drive(Sender::new(jump, rate, [0.5, 9.0], |_| 0.01));
        outcome.check_reached("jump");
        let (speed, acceleration) = outcome.largest_of_reference();
        assert!((0.1..=0.3).contains(&speed), "{law}, {rate} Hz: {speed} m/s");
        assert!(acceleration <= 1.1, "{law}, {rate} Hz: {acceleration} m/s²");
        let farthest = outcome.farthest(jump, 8.0, 8.9);
        assert!(farthest < 0.003, "{farthest}, {:?}", outcome.targets());
        let overshoot = outcome.records.iter().map(|it| it.position().unwrap().y);
        let overshoot = overshoot.fold(0.0, f64::max) - jump(9.0).y;
        assert!(overshoot < 0.02, "{law}, {rate} Hz: {overshoot}");
    }
}

/// A target that is dragged to and fro, at up to 60 cm/s.
fn shaken(time: f64) -> Point3<f64> {
    CENTRE + Vector3::new(0.15 * (4.0 * time).sin(), 0.0, 0.0)
}

#[test]
fn a_target_that_is_too_fast_for_the_ball_stops_no_board() {
    for law in [LawName::Adaptive, LawName::Taut] {
        let run = TargetRun { law, ..TargetRun::default() };
        let outcome = run.drive(Sender::new(shaken, 30.0, [0.2, 20.0], jitter(4)));
        outcome.check_reached("shaken");
        let apart = outcome.farthest_from_reference();
        assert!(apart < 0.07, "{law}: the reference is {apart} m from the ball");
        let told = outcome.events.iter().filter(|(_, event)| *event == TargetsEvent::Lagging);
        assert_eq!(told.count(), 1, "{law}: {:?}", outcome.events);
    }
}

/// A target that goes round the ball: within 6 cm of it, and faster than the motors.
fn around(time: f64) -> Point3<f64> {
    let (sin, cos) = (5.0 * time).sin_cos();
    CENTRE + Vector3::new(0.04 * cos, 0.04 * sin, 0.0)
}

#[test]
fn a_target_that_goes_round_the_ball_is_told_and_is_not_caught_up_with() {
    let run = TargetRun { max_rate: Some(50.0), ..TargetRun::default() };
    let outcome = run.drive(Sender::new(around, 30.0, [0.5, 20.0], jitter(5)));
    let told = outcome.events.iter().filter(|(_, event)| *event == TargetsEvent::Lagging);
    assert_eq!(told.count(), 1, "{:?}", outcome.events);
}

/// A target that a person drags out of the triangle of the motors in a second.
fn dragged_out(time: f64) -> Point3<f64> {
    let way = ((time - 0.8) / 1.0).clamp(0.0, 1.0);
    Point3::new(0.56 - 0.46 * way, 0.395 + 0.105 * way, 0.30)
}

#[test]
fn a_target_that_is_dragged_out_of_the_triangle_stops_no_board() {
    for law in [LawName::Adaptive, LawName::Taut] {
        let run = TargetRun { law, ..TargetRun::default() };
        let sender = Box::new(Sender::new(dragged_out, 30.0, [0.8, 12.0], |_| 0.01));
        let outcome = run.drive_with(sender, TargetUse::Steering, |number, sender| {
            if number == 300 {
                sender.send(OperatorCommand::End).unwrap();
            }
        });
        assert_eq!(outcome.summary.ending, StopReason::Ended, "{law}: {:?}", outcome.targets());
        let last = outcome.records.last().unwrap();
        // The last place in the triangle; the refused ones do not begin it anew.
        let last_good = Point3::new(0.4373, 0.4230, 0.30);
        assert!((last.position().unwrap() - last_good).norm() < 0.003, "{law}: {last:?}");
        let held = outcome.records.iter().filter(|record| record.time > 7.0);
        let mut states = held.map(|record| record.board.unwrap().state);
        assert!(states.all(|state| state == State::Holding), "{law}");
    }
}

/// Lowest height of the paper's workspace, metres.
const FLOOR: f64 = 0.05;

/// A target that swings through the lower border of the workspace, at up to 15 cm/s.
fn swing(time: f64) -> Point3<f64> {
    Point3::new(CENTRE.x, CENTRE.y, FLOOR + 0.05 + 0.1 * (1.5 * time).cos())
}

#[test]
fn a_target_that_leaves_the_workspace_is_refused_and_followed_when_it_is_back() {
    for rate in [30.0, 200.0] {
        let outcome = TargetRun::default().drive(Sender::new(swing, rate, [0.5, 20.0], jitter(3)));
        outcome.check_reached("swing");
        let targets = outcome.targets();
        assert!(targets.refused > 100 && targets.taken > 300, "{targets:?}");
        let refusals = outcome
            .events
            .iter()
            .filter(|(_, event)| matches!(event, TargetsEvent::Refused { .. }));
        let count = refusals.count();
        assert!((3..10).contains(&count), "{count} messages, one a second at most");
        let lowest = outcome.records.iter().map(|it| it.position().unwrap().z);
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        assert!((FLOOR..FLOOR + 0.02).contains(&lowest), "{lowest}");
        // At the highest place the ball is with its target again.
        let highest = 4.0 * std::f64::consts::PI / 1.5;
        let farthest = outcome.farthest(swing, highest - 0.2, highest + 0.2);
        assert!(farthest < 0.010, "{farthest}");
    }
}

#[test]
fn lines_that_are_held_up_are_left_out_and_the_ball_rests_meanwhile() {
    // From 4 s to 6 s nothing comes; then all of it at once.
    let held = |k: u64| {
        let time = 0.5 + k as f64 / 30.0;
        if (4.0..6.0).contains(&time) { 6.0 - time } else { 0.01 }
    };
    let times = (0..).map(|k| 0.5 + f64::from(k) / 30.0).take_while(|time| *time < 11.0);
    let outcome = TargetRun::default().drive(Sender::of(times, circle, held));
    outcome.check_reached("held up");
    let targets = outcome.targets();
    assert!((40..=50).contains(&targets.left_out.late), "{targets:?}");
    let rest = circle(4.0 + 0.6);
    let places = outcome.records.iter().filter(|it| (5.5..6.0).contains(&it.time));
    let far = places.map(|it| (it.position().unwrap() - rest).norm()).fold(0.0, f64::max);
    assert!(far < 0.006, "{far}");
    assert!(outcome.farthest(circle, 9.0, 10.9) < 0.005);
}

/// Returns the times of 30 lines a second for so many seconds.
fn lines_until(end: f64) -> impl Iterator<Item = f64> {
    (15..).map(|k| f64::from(k) / 30.0).take_while(move |time| *time < end)
}

#[test]
fn a_clock_that_is_set_while_targets_come_is_followed() {
    for step in [-0.6, -0.3, 0.6, -5.0] {
        let clock = |time: f64| if time < 12.0 { time } else { time + step };
        let sender = Sender::with_clock(lines_until(20.0), circle, jitter(6), clock);
        let outcome = TargetRun::default().drive(sender);
        outcome.check_reached("set");
        let targets = outcome.targets();
        let left_out = targets.left_out.late + targets.left_out.out_of_order;
        assert!(left_out < 60, "{step} s: {targets:?}");
        let farthest = outcome.farthest(circle, 14.0, 19.9);
        assert!(farthest <= 0.006, "{step} s: {farthest} m");
    }
}

#[test]
fn a_ball_at_the_last_target_that_counted_has_not_reached_those_that_were_left_out() {
    // Later and later: a counter of 30 lines a second, of which 27 are sent.
    let slow = |time: f64| 0.9 * time;
    let sender = Sender::with_clock(lines_until(40.0), circle, jitter(7), slow);
    let outcome = TargetRun::default().drive(sender);
    let targets = outcome.targets();
    assert!(targets.left_out.late > 500, "{targets:?}");
    assert!(!outcome.summary.reached, "{targets:?}");
    assert_eq!(outcome.summary.ending, StopReason::TargetsBroken);
    assert!(targets.near < 200 && targets.followed > 500, "{targets:?}");
    // At rest, and then above the workspace.
    let leaves = |time| if time < 6.0 { CENTRE } else { CENTRE + Vector3::z() };
    let outcome = TargetRun::default().drive(Sender::of(lines_until(20.0), leaves, |_| 0.01));
    assert_eq!(outcome.summary.ending, StopReason::TargetsRefused);
    assert!(!outcome.summary.reached, "{:?}", outcome.targets());
    // A person ends the run meanwhile.
    let sender = Box::new(Sender::of(lines_until(20.0), leaves, |_| 0.01));
    let outcome = TargetRun::default().drive_with(sender, TargetUse::Steering, |number, sender| {
        if number == 400 {
            sender.send(OperatorCommand::End).unwrap();
        }
    });
    assert_eq!(outcome.summary.ending, StopReason::Ended);
    assert!(!outcome.summary.reached, "{:?}", outcome.targets());
}

#[test]
fn a_stream_without_a_target_ends_the_run_with_the_reason() {
    let outcome = TargetRun::default().drive(Sender::new(circle, 30.0, [1.0, 1.0], |_| 0.0));
    assert_eq!(outcome.summary.ending, StopReason::NoTarget);
    assert!(!outcome.summary.reached && outcome.summary.legs.is_empty());
    let late = Sender::new(circle, 30.0, [30.0, 31.0], |_| 0.0);
    let outcome = TargetRun { timeout: 2.0, ..TargetRun::default() }.drive(late);
    assert_eq!(outcome.summary.ending, StopReason::TargetsSilent);
    assert!(!outcome.summary.reached && outcome.records.last().unwrap().time < 3.0);
    let above = Sender::new(|_| Point3::new(0.45, 0.30, 9.0), 30.0, [0.5, 31.0], |_| 0.0);
    let outcome = TargetRun { timeout: 2.0, ..TargetRun::default() }.drive(above);
    assert_eq!(outcome.summary.ending, StopReason::TargetsRefused);
    let sender = Sender::new(circle, 30.0, [0.5, 2.0], |_| 0.0);
    let outcome = TargetRun { timeout: 2.0, is_seen: false, ..TargetRun::default() }.drive(sender);
    assert_eq!(outcome.summary.ending, StopReason::TargetsNotFollowed);
    let endless = Sender::new(circle, 30.0, [0.5, 30.0], |_| 0.0);
    let outcome = TargetRun { timeout: 5.0, is_seen: false, ..TargetRun::default() }.drive(endless);
    assert_eq!(outcome.summary.ending, StopReason::TargetsNotFollowed);
    assert!(outcome.has(&TargetsEvent::NotFollowed) && outcome.summary.time_s < 6.0);
    assert!(outcome.targets().to_string().ends_with("the board followed none of them"));
}

#[test]
fn a_stop_ends_a_motion_and_a_new_one_moves_the_ball_again() {
    let first = Sender::new(circle, 30.0, [0.5, 12.0], |_| 0.01);
    let second = Sender::new(circle, 30.0, [7.0, 12.0], |_| 0.01);
    let source = Box::new(Two::new([first, second]));
    let outcome = TargetRun::default().drive_with(source, TargetUse::Steering, |number, sender| {
        let command = match number {
            120 => OperatorCommand::Stop,
            180 => OperatorCommand::Resume { stop: 1 },
            355 => OperatorCommand::End,
            _ => return,
        };
        sender.send(command).unwrap();
    });
    let endings: Vec<_> = outcome.summary.legs.iter().map(|leg| leg.ending.clone()).collect();
    assert_eq!(endings, [StopReason::Replaced, StopReason::Stopped, StopReason::Ended]);
    let state = |time: f64| {
        let record = outcome.records.iter().find(|record| record.time >= time).unwrap();
        record.board.unwrap().state
    };
    // The first motion goes on after the Stop at 4 s, and moves nothing.
    assert_eq!(
        [state(3.5), state(5.5), state(6.9), state(8.0)],
        [State::Following, State::Ready, State::Ready, State::Following,]
    );
    assert!(outcome.targets().ended > 100, "{:?}", outcome.targets());
    assert!(outcome.farthest(circle, 10.0, 11.5) < 0.005);
}
