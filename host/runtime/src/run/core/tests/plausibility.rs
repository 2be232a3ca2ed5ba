//! Positions that cannot be those of the ball on the cables.

use super::*;
use crate::doubt::Doubt;
use crate::run::plausibility::{BallSpeed, Plausibility};

/// A quarter of the turn of a motor that stops a board whose ball does not follow, Q4 steps.
const TURN: i32 = 1600;

/// Rounds for which a position comes, of 0.05 s each.
const ROUNDS: usize = 40;

/// Returns a run to one target whose ball moves at 0.75 m/s at most, and has answered no motor.
fn run(usage: TargetUse) -> Bench {
    let mut bench = Bench::before(1, false, usage);
    bench.core.plausibility = Plausibility::new(BallSpeed { max: 0.75, motor_rate: 6400.0 }, TURN);
    bench.step(Input::Begin { is_stopped: false });
    bench
}

/// Takes a picture of the ball beside its target by so many metres.
fn look(bench: &mut Bench, state: State, beside: f64) {
    bench.telemetry(state, true);
    let [x, y, z] = TARGET;
    bench.picture([x, y + beside, z]);
    bench.tick();
}

/// Moves the ball by 100 mm to its target, with the motors.
fn answer(bench: &mut Bench) {
    for round in 0..20 {
        bench.motors = [200 * round; 3];
        look(bench, State::Seeking, 0.1 - 0.005 * f64::from(round));
    }
}

/// Returns the reasons for which legs have ended, and the doubts that were told.
fn outcome(bench: &Bench) -> (Vec<StopReason>, Vec<Doubt>) {
    let reason = |event: &RunEvent| match event {
        RunEvent::TargetEnded { reason, .. } => Some(reason.clone()),
        _ => None,
    };
    let doubt = |event: &RunEvent| match event {
        RunEvent::Doubt(doubt) => Some(*doubt),
        _ => None,
    };
    let events = &bench.events;
    (events.iter().filter_map(reason).collect(), events.iter().filter_map(doubt).collect())
}

#[test]
fn a_ball_whose_two_depths_differ_is_told_and_reaches_nothing() {
    for (factor, is_told, is_refused) in [
        (1.0, false, false),
        (0.97, false, false),
        (1.03, false, false),
        (0.95, true, false),
        (1.06, true, false),
        (0.9, true, true),
        (1.1, true, true),
    ] {
        let mut bench = run(TargetUse::Steering);
        bench.depths = Some(TwoDepths { by_outline: 1.25, by_pixels: 1.25 * factor });
        answer(&mut bench);
        for _ in 0..ROUNDS {
            look(&mut bench, State::Holding, 0.0);
        }
        let (reasons, doubts) = outcome(&bench);
        let doubt = bench.depths.map(Doubt::Depth).filter(|_| is_told);
        assert_eq!(doubts, Vec::from_iter(doubt), "{factor}");
        let refused = doubt.filter(|_| is_refused).map(StopReason::Doubt);
        assert_eq!(reasons, [refused.unwrap_or(StopReason::Reached)], "{factor}");
    }
}

#[test]
fn a_jump_that_stays_ends_the_drive_and_one_that_returns_does_not() {
    // 4 m/s; the cables of the paper's rig move at 0.19 m/s.
    for (pictures, is_jump) in [(1, false), (4, false), (ROUNDS, true)] {
        let mut bench = run(TargetUse::Steering);
        answer(&mut bench);
        for _ in 0..pictures {
            look(&mut bench, State::Seeking, 0.14);
        }
        for _ in 0..ROUNDS {
            look(&mut bench, State::Holding, if is_jump { 0.14 } else { 0.0 });
        }
        let (reasons, doubts) = outcome(&bench);
        if is_jump {
            let [Doubt::Jump(distance)] = doubts[..] else { panic!("{doubts:?}") };
            // The last place before the jump is 5 mm from the target.
            assert!((distance - 0.135).abs() < 1e-6, "{distance}");
            assert_eq!(reasons, [StopReason::Doubt(doubts[0])]);
        } else {
            assert_eq!((reasons, doubts), (vec![StopReason::Reached], Vec::new()), "{pictures}");
        }
    }
}

#[test]
fn nothing_is_reached_while_the_ball_may_have_jumped() {
    let mut bench = run(TargetUse::Steering);
    bench.core.plausibility.note_answer();
    for _ in 0..3 {
        look(&mut bench, State::Seeking, 0.14);
    }
    for _ in 0..8 {
        look(&mut bench, State::Holding, 0.0);
        assert!(outcome(&bench).0.is_empty());
    }
    for _ in 0..8 {
        look(&mut bench, State::Holding, 0.0);
    }
    assert!(matches!(outcome(&bench).0[..], [StopReason::Doubt(Doubt::Jump(_))]));
}

/// A motion that is as fast as the cables, in pictures as slow as 5 a second.
#[test]
fn a_ball_that_the_motors_move_has_not_jumped() {
    for pause in [0.0, 0.15] {
        let mut bench = run(TargetUse::Steering);
        for round in 0..20 {
            bench.now += pause;
            let beside = 0.19 * bench.now - 0.01 * f64::from(round % 2);
            look(&mut bench, State::Seeking, beside);
        }
        assert_eq!(outcome(&bench), (Vec::new(), Vec::new()), "{pause}");
    }
}

/// A camera that repeats its last picture for a while, or an emulated rig that stood still.
#[test]
fn pictures_that_stood_still_while_the_motors_turned_are_no_jump() {
    for (turned, is_jump) in [(TURN + 400, false), (TURN / 4, true)] {
        let mut bench = run(TargetUse::Steering);
        answer(&mut bench);
        let motors = bench.motors;
        for _ in 0..8 {
            look(&mut bench, State::Seeking, 0.005);
        }
        for round in 0..ROUNDS {
            // The news of the motors comes one picture later.
            let turned = if round == 0 { 0 } else { turned };
            bench.motors = motors.map(|at| at + turned);
            look(&mut bench, State::Seeking, 0.125);
        }
        assert_eq!(!outcome(&bench).1.is_empty(), is_jump, "{turned}");
    }
}

/// A program that stood still for a while: its next picture has the time of the one before. The
/// news of the motors comes with that picture, or with an old one before it.
#[test]
fn a_picture_with_an_early_time_is_no_jump_where_the_motors_have_turned() {
    for (turned, is_jump) in [(2 * TURN, false), (TURN / 4, true)] {
        for old_pictures in [0, 1] {
            let mut bench = run(TargetUse::Steering);
            answer(&mut bench);
            bench.motors = bench.motors.map(|at| at + turned);
            for _ in 0..old_pictures {
                look(&mut bench, State::Seeking, -0.001);
            }
            for _ in 0..ROUNDS {
                look(&mut bench, State::Seeking, 0.145);
            }
            let has_jumped = !outcome(&bench).1.is_empty();
            assert_eq!(has_jumped, is_jump, "{turned}, {old_pictures}");
        }
    }
}

#[test]
fn a_ball_that_hangs_at_its_target_is_already_there() {
    for usage in [TargetUse::Steering, TargetUse::Goal] {
        let mut bench = run(usage);
        look(&mut bench, State::Holding, 0.001);
        assert_eq!(outcome(&bench).0, [StopReason::AlreadyThere]);
        assert!(bench.core.legs.all_done() && !bench.core.legs.all_reached());
        let is_over = matches!(bench.ending, Some(Ok(StopReason::AlreadyThere)));
        assert_eq!(is_over, usage == TargetUse::Goal);
    }
}

#[test]
fn of_two_balls_the_one_that_has_answered_no_motor_reaches_nothing() {
    let mut bench = run(TargetUse::Steering);
    bench.has_rival = true;
    look(&mut bench, State::Seeking, 0.001);
    for _ in 0..3 {
        look(&mut bench, State::Holding, 0.001);
    }
    let (reasons, doubts) = outcome(&bench);
    assert_eq!(
        (reasons, doubts),
        (vec![StopReason::Doubt(Doubt::TwoBalls)], vec![Doubt::TwoBalls])
    );
    let mut bench = run(TargetUse::Steering);
    bench.has_rival = true;
    answer(&mut bench);
    look(&mut bench, State::Holding, 0.0);
    assert_eq!(outcome(&bench), (vec![StopReason::Reached], vec![Doubt::TwoBalls]));
}

#[test]
fn a_ball_that_stays_while_the_motors_turn_reaches_nothing() {
    let mut bench = run(TargetUse::Steering);
    look(&mut bench, State::Seeking, 0.001);
    bench.motors = [0, -TURN, 0];
    for round in 0..ROUNDS {
        look(&mut bench, State::Holding, 0.001 * (round % 3) as f64);
    }
    assert!(outcome(&bench).0.is_empty());
}
