//! The tracker, the detector of an arrival and the guards at their limits.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at the first error")]

use crate::common::{config, params};
use plumb_core::MotorRates;
use plumb_core::law::{InlineLaw, Law, LawSelection, Measurement, Setpoint};
use plumb_core::plan::{Planner, RunOut};
use plumb_core::servo::{
    ArrivalDetector, BallPosition, BallTracker, DriveState, Guards, MotorPositions, MotorsOfDrive,
    ReferenceTick, Servo,
};
use plumb_protocol::Config;
use plumb_protocol::config::{Growth, Reached};
use plumb_protocol::message::{Fault, Knot, Reference};
use plumb_protocol::units::{Micrometres, Micros, Milliseconds, Point, Speed};

/// Largest plausible move of the ball along an axis, µm.
const MAX_MOVE: i32 = 25_000;

/// Returns the x of the filtered position after the positions `xs`, µm.
fn filtered(xs: &[i32]) -> i32 {
    let mut tracker = BallTracker::default();
    xs.iter().for_each(|x| tracker.update(Micros(0), [*x, 0, 0]));
    tracker.filtered().unwrap()[0]
}

#[test]
fn a_move_by_the_largest_plausible_distance_is_none_of_an_outlier() {
    assert_eq!(filtered(&[0, MAX_MOVE]), MAX_MOVE / 4);
    assert_eq!(filtered(&[0, MAX_MOVE + 1]), 0);
}

#[test]
fn the_third_outlier_in_a_row_is_taken_in() {
    let away = 400_000;
    assert_eq!(filtered(&[0, away, away]), 0);
    assert_eq!(filtered(&[0, away, away, away]), away / 4);
}

#[test]
fn the_last_position_is_unfiltered() {
    let mut tracker = BallTracker::default();
    assert_eq!(tracker.last(), None);
    tracker.update(Micros(7), [1, 2, 3]);
    tracker.update(Micros(8), [4_000, -5, 6]);
    assert_eq!((tracker.last(), tracker.captured()), (Some([4_000, -5, 6]), Some(Micros(8))));
}

/// Returns the number of the position at which a ball at the distances `at` (µm, of the number)
/// has reached its target within 10 mm, of 200.
fn reached_at(frames: u8, at: impl Fn(usize) -> i32) -> Option<usize> {
    let rule = Reached { radius: Micrometres(10_000), frames };
    let mut arrival = ArrivalDetector::default();
    (0..200).find(|k| {
        arrival.observe([0, at(*k), 0], &rule);
        arrival.has_arrived(&rule)
    })
}

/// The first position only begins the filter.
#[test]
fn a_target_is_reached_within_nine_tenths_of_its_radius_after_the_least_number_of_positions() {
    assert_eq!(reached_at(10, |_| 0), Some(10));
    assert_eq!(reached_at(40, |_| 8_000), Some(40));
    assert_eq!(reached_at(10, |_| 9_001), None);
    // Positions a little farther away do not count.
    assert!(reached_at(10, |k| if k < 9 { 9_500 } else { 8_000 }).is_some_and(|k| k >= 18));
}

/// The guard compares the nearest position so far with the present target, whichever targets were
/// between.
#[test]
fn a_target_that_comes_back_finds_the_guard_armed() {
    let params = params(config());
    let (here, there) = (Point([Micrometres(0); 3]), Point([500_000, 0, 0].map(Micrometres)));
    let mut guards = Guards::default();
    let mut update = |ms: u64, x: i32, target| {
        let motors = MotorsOfDrive { present: [0; 3], at_capture: [0; 3] };
        let now = Micros(ms * 1000);
        guards.update(now, &DriveState::new(now, [x, 0, 0], target, motors), &params)
    };
    assert_eq!(update(0, 0, here), None);
    assert_eq!(update(33, -1_000, there), None);
    // The ball is 100 mm away from a target that it has been at.
    assert_eq!(update(66, 100_000, here), None);
    assert_eq!(update(665, 100_000, here), None);
    assert_eq!(update(666, 100_000, here), Some(Fault::ErrorGrowing));
}

/// Time between two positions, ms.
const FRAME_MS: u64 = 33;

/// A drive along x, from 0: motor A turns by a step for a millimetre of the ball.
struct Drive {
    guards: Guards,
    frame: u64,
    /// Position of the ball, µm.
    ball: i32,
    target: i32,
    /// Whether the motor is reversed: it turns back where the ball goes on.
    is_reversed: bool,
}

impl Drive {
    /// Begins a drive to a target at 500 mm. The ball has gone 300 mm of its way.
    fn new(is_reversed: bool) -> Self {
        let target = if is_reversed { -500_000 } else { 500_000 };
        let mut drive = Self { guards: Guards::default(), frame: 0, ball: 0, target, is_reversed };
        assert_eq!(drive.move_by(10_000, if is_reversed { 1 } else { 30 }), None);
        drive
    }

    /// Returns the position of motor A, Q4 steps.
    fn motor(&self) -> i32 {
        let turned = self.ball / 1000 * 16;
        if self.is_reversed { -turned } else { turned }
    }

    /// Replaces the target by one at `target`, µm. The motors come to rest after a turn that moves
    /// the ball by `rest`, µm, in `time_ms`.
    fn replace(&mut self, target: i32, rest: i32, time_ms: u64) {
        let end = Self { ball: self.ball + rest, guards: self.guards, ..*self }.motor();
        let run_out = RunOut { motors: [end, 0, 0], time_us: time_ms * 1000 };
        let now = Micros(self.frame * FRAME_MS * 1000);
        self.guards.note_change(now, [self.target - self.ball, 0, 0], &run_out);
        self.target = target;
    }

    /// Moves the ball by `step`, µm, in each of `frames` frames. Returns the first fault.
    fn move_by(&mut self, step: i32, frames: u32) -> Option<Fault> {
        let params = params(Config {
            growth: Growth { margin: Micrometres(40_000), time: Milliseconds(200) },
            ..config()
        });
        (0..frames).find_map(|_| {
            self.frame += 1;
            self.ball += step;
            let now = Micros(self.frame * FRAME_MS * 1000);
            let at = [self.motor(), 0, 0];
            let motors = MotorsOfDrive { present: at, at_capture: at };
            let target = Point([self.target, 0, 0].map(Micrometres));
            let state = DriveState::new(now, [self.ball, 0, 0], target, motors);
            self.guards.update(now, &state, &params)
        })
    }
}

/// Frames after which a ball that moves by 10 mm a frame is stopped: 40 mm, and then 200 ms.
const STOPPED_AFTER: u32 = 5 + 7;

#[test]
fn a_ball_in_its_run_out_is_no_divergence() {
    let mut drive = Drive::new(false);
    drive.replace(-500_000, 200_000, 600);
    assert_eq!(drive.move_by(10_000, 20), None);
    // It comes back.
    assert_eq!(drive.move_by(-10_000, 60), None);
}

/// After the run-out of 200 ms, 8 positions later.
#[test]
fn a_run_out_ends_when_its_setpoints_have_run_out() {
    let mut drive = Drive::new(false);
    drive.replace(-500_000, 70_000, 200);
    assert_eq!(drive.move_by(10_000, 6 + 8 + STOPPED_AFTER - 1), None);
    assert_eq!(drive.move_by(10_000, 1), Some(Fault::ErrorGrowing));
}

#[test]
fn a_ball_that_turns_back_from_its_run_out_and_leaves_its_target_is_stopped_at_once() {
    let mut drive = Drive::new(false);
    drive.replace(900_000, 200_000, 600);
    assert_eq!(drive.move_by(-10_000, STOPPED_AFTER - 1), None);
    assert_eq!(drive.move_by(-10_000, 1), Some(Fault::ErrorGrowing));
}

#[test]
fn a_ball_that_motors_at_rest_leave_alone_has_no_run_out() {
    let mut drive = Drive::new(false);
    assert_eq!(drive.move_by(0, 40), None);
    drive.replace(-500_000, 0, 0);
    assert_eq!(drive.move_by(10_000, STOPPED_AFTER - 1), None);
    assert_eq!(drive.move_by(10_000, 1), Some(Fault::ErrorGrowing));
}

/// The ball of a reversed motor goes away from every target. Targets come with every position, on
/// both sides of the ball's way.
#[test]
fn targets_that_come_often_give_a_ball_on_the_wrong_way_no_run_out() {
    for frames in [1, 2, 5] {
        let mut drive = Drive::new(true);
        let mut moved = 1;
        let fault = loop {
            drive.replace(-500_000 - 100_000 * (moved % 2), 200_000, 600);
            if let Some(fault) = drive.move_by(10_000, frames) {
                break fault;
            }
            moved += 1;
            assert!(moved < 100, "no stop with a target every {frames} positions");
        };
        assert_eq!(fault, Fault::ErrorGrowing);
        assert!(drive.frame <= u64::from(1 + STOPPED_AFTER), "{frames}: {}", drive.frame);
    }
}

/// Up to the deadline the motors coast, and the drive goes on.
#[test]
fn a_position_is_missed_from_the_microsecond_after_its_deadline_on() {
    let params = params(config());
    let deadline = u64::from(config().deadlines.position.0) * 1000;
    let LawSelection::Inline(law) = params.law() else { panic!("the law of these tests") };
    let mut servo = Servo::new(Some(law));
    servo.begin_drive(Micros(0), &Planner::default());
    let position = BallPosition { captured: Micros(0), ball: [0; 3], covariance: None };
    let target = Some(Point([Micrometres(100_000); 3]));
    servo.on_position(Micros(0), &position, target, &MotorPositions::UNUSED, &params);
    let rates = |time| servo.setpoint(Micros(time), &params).rates;
    assert_ne!(rates(deadline), MotorRates::default());
    assert_eq!(rates(deadline + 1), MotorRates::default());
    assert!(!servo.position_lost(Micros(deadline), &params));
    assert!(servo.position_lost(Micros(deadline + 1), &params));
}

/// When a path begins, µs.
const START: u64 = 1_000_000;

/// Returns a servo that follows a line along x with 100 mm/s.
fn following<L: Law>(law: Option<L>) -> Servo<L> {
    let knot = |k: usize| Knot {
        position: Point([50_000 * k as i32, 0, 0].map(Micrometres)),
        velocity: [Speed(100_000), Speed(0), Speed(0)],
    };
    let reference = Reference {
        sequence: 0,
        now: Micros(0),
        waits: false,
        first: Micros(0),
        interval_us: 500_000,
        knots: std::array::from_fn(knot),
    };
    let mut servo = Servo::new(law);
    servo.begin_drive(Micros(START), &Planner::default());
    servo.follow(Micros(START), Point::default(), &reference);
    servo
}

/// A law whose rates are the velocity of its target.
struct Velocity {
    is_used: bool,
}

impl Law for Velocity {
    fn uses_velocity(&self) -> bool {
        self.is_used
    }

    fn update(&mut self, measurement: &Measurement) -> Setpoint {
        Setpoint::at_once(MotorRates(measurement.velocity))
    }
}

#[test]
fn a_law_gets_the_velocity_of_the_reference_if_it_uses_it() {
    let params = params(config());
    for is_used in [true, false] {
        let mut servo = following(Some(Velocity { is_used }));
        let end = START + 1_500_000;
        for now in (START..end).step_by(200) {
            servo.advance_reference(Micros(now), ReferenceTick::FREE, &params);
        }
        let position = BallPosition { captured: Micros(end), ball: [0; 3], covariance: None };
        let target = Some(Point::default());
        servo.on_position(Micros(end), &position, target, &MotorPositions::UNUSED, &params);
        let MotorRates([x, y, z]) = servo.setpoint(Micros(end), &params).rates;
        let expected = if is_used { 100_000 } else { 0 };
        assert!((x - expected).abs() < 2_000 && [y, z] == [0; 2], "{is_used}: {x}");
    }
}

/// Returns the microseconds until a reference has a pace, of a tick every 200.
fn time_to_pace(is_busy: bool) -> u64 {
    let params = params(config());
    let mut servo = following::<InlineLaw>(None);
    let mut ticks = (0..).step_by(200);
    ticks
        .find(|time| {
            let now = Micros(START + time);
            let tick = ReferenceTick { is_busy, ..ReferenceTick::FREE };
            servo.advance_reference(now, tick, &params);
            servo.reference_state(now).unwrap().pace > 0
        })
        .unwrap()
}

/// The pace is found in the second part of a state. A part needs a tick without other work, or is
/// more than 4 ms late.
#[test]
fn a_tick_with_other_work_leaves_the_reference_to_a_later_one() {
    assert_eq!(time_to_pace(false), 400);
    assert_eq!(time_to_pace(true), 4_200 + 400 + 4_200);
}
