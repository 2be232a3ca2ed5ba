//! What the bank is to do with pictures, good and bad.

use super::bank::Bank;
use super::calm::Watch;
use super::geometry::{Vector, along, length};
use super::{Law, Limits, Measurement, Seen, Taut};

fn seen(ball: Vector, motors: Vector) -> Seen {
    Seen { ball, variances: [4.0, 1.0, 1.0], motors, turned: [0.0; 3], faster: [0.0; 3] }
}

/// How far the ball's estimate is from `ball`, mm.
fn off(bank: &Bank, ball: Vector) -> f32 {
    let believed = bank.belief([0.0; 3]).ball;
    length([0, 1, 2].map(|i| believed[i] - ball[i]))
}

#[test]
fn a_strange_picture_is_passed_over_and_the_third_in_a_row_is_believed() {
    let (home, away) = ([0.0, 0.0, -500.0], [0.0, 200.0, -500.0]);
    let mut bank = Bank::new(&seen(home, [0.0; 3]), home);
    for _ in 0..10 {
        bank.update(&seen(home, [0.0; 3]), home);
    }
    for _ in 0..2 {
        bank.update(&seen(away, [0.0; 3]), home);
        assert!(off(&bank, home) < 1e-3, "moved by {}", off(&bank, home));
    }
    bank.update(&seen(away, [0.0; 3]), home);
    assert!(off(&bank, away) < 5.0, "still {} away", off(&bank, away));
}

#[test]
fn motion_that_is_seen_tells_how_far_a_step_goes() {
    // Motors A and B pay out together; the ball falls and goes to C's side by what no guess says.
    let (per_step, home) = ([-0.5, 0.0, -0.3], [0.0, 0.0, -500.0]);
    let mut bank = Bank::new(&seen(home, [0.0; 3]), home);
    for k in 1..60 {
        let n = k as f32 * 2.0;
        bank.update(&seen([per_step[0] * n, 0.0, per_step[2] * n - 500.0], [n, n, 0.0]), home);
    }
    let learnt = along(&bank.belief([0.0; 3]).j, [1.0, 1.0, 0.0]);
    let error = length([0, 1, 2].map(|i| learnt[i] - per_step[i]));
    assert!(error < 0.1 * length(per_step), "{learnt:?} for {per_step:?}");
}

#[test]
fn pictures_that_are_later_than_told_do_not_put_the_ball_behind() {
    // Two pictures' times late: 5 mm at this speed, there and back.
    const LATE: usize = 2;
    let (speed, per_step) = (4.0, [-0.5, 0.0, -0.3]);
    let steps = |k: usize| speed * k.min(60 - k) as f32;
    let place = |k: usize| [0, 1, 2].map(|i| [0.0, 0.0, -500.0][i] + steps(k) * per_step[i]);
    let at = |k: usize| {
        let turned = steps(k) - steps(k.saturating_sub(1));
        let motors = [steps(k), steps(k), 0.0];
        Seen { turned: [turned, turned, 0.0], ..seen(place(k.saturating_sub(LATE)), motors) }
    };
    let mut bank = Bank::new(&at(0), place(0));
    for k in 1..50 {
        bank.update(&at(k), place(0));
    }
    assert!(off(&bank, place(49)) < 1.0, "{} mm off", off(&bank, place(49)));
}

/// Errors along x that go from side to side.
fn swing_about(target: Vector, watch: &mut Watch, amplitude: f32, times: usize) {
    for k in 0..times {
        let x = if k % 2 == 0 { amplitude } else { -amplitude };
        for part in [0.3, 1.0, 0.3] {
            assert!(!watch.look(target, [x * part, 0.0, 0.0]), "swinging is not being stuck");
        }
    }
}

#[test]
fn a_swing_calms_the_law_until_there_is_another_target() {
    let mut watch = Watch::new([0.0; 3]);
    swing_about([0.0; 3], &mut watch, 2.0, 30);
    assert_eq!(watch.pace(), 1.0, "noise is no swing");
    swing_about([0.0; 3], &mut watch, 20.0, 5);
    let calmer = watch.pace();
    assert!(calmer < 0.5, "{calmer}");
    swing_about([0.0; 3], &mut watch, 20.0, 60);
    assert!(watch.pace() < calmer && watch.pace() > 0.01, "{}", watch.pace());
    watch.look([0.0, 0.0, 9.0], [1.0; 3]);
    assert_eq!(watch.pace(), 1.0);
}

#[test]
fn a_calmed_law_gets_quicker_while_the_ball_is_far_and_does_not_swing() {
    let mut watch = Watch::new([0.0; 3]);
    swing_about([0.0; 3], &mut watch, 20.0, 5);
    let calmer = watch.pace();
    for k in 0..90 {
        watch.look([0.0; 3], [2.0 + 0.01 * k as f32, 0.0, 0.0]);
    }
    assert_eq!(watch.pace(), calmer, "at the target there is no haste");
    for k in 0..400 {
        watch.look([0.0; 3], [50.0 - 0.1 * k as f32, 0.0, 0.0]);
    }
    assert_eq!(watch.pace(), 1.0);
}

#[test]
fn an_error_that_stays_means_that_the_bank_is_stuck() {
    let mut watch = Watch::new([0.0; 3]);
    let stuck = (0..90).filter(|_| watch.look([0.0; 3], [20.0, 0.0, 0.0])).count();
    assert_eq!(stuck, 1);
}

/// A ball that follows the motors through a resonance (Hz, damping ratio) and is seen three
/// pictures late: its farthest from the target, mm, in the last two of 60 s.
fn farthest_at_the_end(hz: f32, damping: f32) -> f32 {
    // Seen from (0, 0, -120): high up, and a step moves the ball farther than the usual rig's.
    let j = [[-0.7, -0.7, 0.7], [-0.6, 0.6, 0.0], [-1.2, -1.2, -0.6]];
    let omega = core::f32::consts::TAU * hz;
    let (start, target) = ([0.0, 0.0, -400.0], [0.0, 80.0, -300.0]);
    let mut law = Taut::new(Limits { rate: 400 * 256, acceleration: 2000 });
    let (mut motors, mut rates, mut ball, mut speed) = ([0.0; 3], [0.0; 3], start, [0.0; 3]);
    let mut seen = [(start, motors); 6];
    let mut farthest: f32 = 0.0;
    for frame in 0..1800 {
        for _ in 0..33 {
            motors = [0, 1, 2].map(|k| motors[k] + 1e-3 * rates[k]);
            let moves = along(&j, motors);
            for i in 0..3 {
                let off = start[i] + moves[i] - ball[i];
                speed[i] += 1e-3 * (omega * omega * off - 2.0 * damping * omega * speed[i]);
                ball[i] += 1e-3 * speed[i];
            }
        }
        seen.rotate_left(1);
        seen[5] = (ball, motors);
        let ((ball, then), before) = (seen[2], [seen[1].1, seen[0].1]);
        let micro = |v: Vector| v.map(|v| (v * 1000.0) as i32);
        let sixteenths = |v: Vector| v.map(|v| (v * 16.0) as i32);
        let measurement = Measurement {
            ball: micro(ball),
            variances: [4_000_000, 1_000_000, 1_000_000],
            motors: sixteenths(then),
            motors_before: before.map(sixteenths),
            motors_ahead: sixteenths(motors),
            target: micro(target),
        };
        rates = law.update(&measurement).rates.0.map(|rate| rate as f32 / 256.0);
        if frame >= 1740 {
            farthest = farthest.max(length([0, 1, 2].map(|i| ball[i] - target[i])));
        }
    }
    farthest
}

#[test]
fn a_loop_that_would_swing_for_ever_settles() {
    for (hz, damping) in [(3.0, 0.05), (1.5, 0.03), (0.9, 0.05), (0.8, 0.05), (0.7, 0.05)] {
        let farthest = farthest_at_the_end(hz, damping);
        assert!(farthest < 10.0, "{hz} Hz: still {farthest} mm away");
    }
}
