//! Tests of the filters with good and bad measurements, and of the damping.

use super::geometry::{Vector, along, length};
use super::multi_model::MultiModelFilter;
use super::{Law, Measurement, MotorLimits, Observation, ProgressMonitor, Taut};

fn seen(ball: Vector, motors: Vector) -> Observation {
    Observation {
        ball,
        variances: [4.0, 1.0, 1.0],
        motors,
        turned: [0.0; 3],
        faster: [0.0; 3],
        is_following: false,
    }
}

/// Returns the distance of the estimate from `ball`, mm.
fn off(filter: &MultiModelFilter, ball: Vector) -> f32 {
    let estimate = filter.mixture([0.0; 3]).ball;
    length([0, 1, 2].map(|i| estimate[i] - ball[i]))
}

#[test]
fn two_outliers_are_skipped_and_the_third_in_a_row_is_accepted() {
    let (home, away) = ([0.0, 0.0, -500.0], [0.0, 200.0, -500.0]);
    let mut filter = MultiModelFilter::new(&seen(home, [0.0; 3]), home);
    for _ in 0..10 {
        filter.update(&seen(home, [0.0; 3]), home);
    }
    for _ in 0..2 {
        filter.update(&seen(away, [0.0; 3]), home);
        assert!(off(&filter, home) < 1e-3, "moved by {}", off(&filter, home));
    }
    filter.update(&seen(away, [0.0; 3]), home);
    assert!(off(&filter, away) < 5.0, "still {} away", off(&filter, away));
}

#[test]
fn measured_motion_corrects_the_cable_of_a_step() {
    // Motors A and B pay out together; the ball falls and goes to C's side differently from every
    // guess.
    let (per_step, home) = ([-0.5, 0.0, -0.3], [0.0, 0.0, -500.0]);
    let mut filter = MultiModelFilter::new(&seen(home, [0.0; 3]), home);
    for k in 1..60 {
        let n = k as f32 * 2.0;
        filter.update(&seen([per_step[0] * n, 0.0, per_step[2] * n - 500.0], [n, n, 0.0]), home);
    }
    let learnt = along(&filter.mixture([0.0; 3]).j, [1.0, 1.0, 0.0]);
    let error = length([0, 1, 2].map(|i| learnt[i] - per_step[i]));
    assert!(error < 0.1 * length(per_step), "{learnt:?} for {per_step:?}");
}

#[test]
fn a_delay_beyond_the_age_does_not_bias_the_position() {
    // A delay of two frame times: 5 mm at this speed, there and back.
    const LATE: usize = 2;
    let (speed, per_step) = (4.0, [-0.5, 0.0, -0.3]);
    let steps = |k: usize| speed * k.min(60 - k) as f32;
    let place = |k: usize| [0, 1, 2].map(|i| [0.0, 0.0, -500.0][i] + steps(k) * per_step[i]);
    let at = |k: usize| {
        let turned = steps(k) - steps(k.saturating_sub(1));
        let motors = [steps(k), steps(k), 0.0];
        Observation { turned: [turned, turned, 0.0], ..seen(place(k.saturating_sub(LATE)), motors) }
    };
    let mut filter = MultiModelFilter::new(&at(0), place(0));
    for k in 1..50 {
        filter.update(&at(k), place(0));
    }
    assert!(off(&filter, place(49)) < 1.0, "{} mm off", off(&filter, place(49)));
}

/// Feeds errors along x that change sides.
fn swing_about(target: Vector, progress: &mut ProgressMonitor, amplitude: f32, times: usize) {
    for k in 0..times {
        let x = if k % 2 == 0 { amplitude } else { -amplitude };
        for part in [0.3, 1.0, 0.3] {
            assert!(!progress.update(target, [x * part, 0.0, 0.0]), "a swing is not stuck");
        }
    }
}

#[test]
fn swings_reduce_the_pace_until_the_target_changes() {
    let mut progress = ProgressMonitor::new([0.0; 3]);
    swing_about([0.0; 3], &mut progress, 2.0, 30);
    assert_eq!(progress.pace(), 1.0, "noise is no swing");
    swing_about([0.0; 3], &mut progress, 20.0, 5);
    let slower = progress.pace();
    assert!(slower < 0.5, "{slower}");
    swing_about([0.0; 3], &mut progress, 20.0, 60);
    assert!(progress.pace() < slower && progress.pace() > 0.01, "{}", progress.pace());
    progress.update([0.0, 0.0, 9.0], [1.0; 3]);
    assert_eq!(progress.pace(), 1.0);
}

#[test]
fn the_pace_recovers_while_the_ball_is_far_and_does_not_swing() {
    let mut progress = ProgressMonitor::new([0.0; 3]);
    swing_about([0.0; 3], &mut progress, 20.0, 5);
    let slower = progress.pace();
    for k in 0..90 {
        progress.update([0.0; 3], [2.0 + 0.01 * k as f32, 0.0, 0.0]);
    }
    assert_eq!(progress.pace(), slower, "the pace stays at the target");
    for k in 0..400 {
        progress.update([0.0; 3], [50.0 - 0.1 * k as f32, 0.0, 0.0]);
    }
    assert_eq!(progress.pace(), 1.0);
}

#[test]
fn a_constant_error_means_that_the_filters_are_stuck() {
    let mut progress = ProgressMonitor::new([0.0; 3]);
    let stuck = (0..90).filter(|_| progress.update([0.0; 3], [20.0, 0.0, 0.0])).count();
    assert_eq!(stuck, 1);
}

/// Simulates a ball that follows the motors through a resonance (Hz, damping ratio), measured with
/// a delay of three frames. Returns the largest distance from the target in the last two of 60 s,
/// mm.
fn farthest_at_the_end(hz: f32, damping: f32) -> f32 {
    // The rig at (0, 0, -120): close to the motors, where a step moves the ball farther than usual.
    let j = [[-0.7, -0.7, 0.7], [-0.6, 0.6, 0.0], [-1.2, -1.2, -0.6]];
    let omega = core::f32::consts::TAU * hz;
    let (start, target) = ([0.0, 0.0, -400.0], [0.0, 80.0, -300.0]);
    let mut law = Taut::new(MotorLimits { rate: 400 * 256, acceleration: 2000, count: 3 }, None);
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
            velocity: [0; 3],
        };
        rates = law.update(&measurement).rates.0.map(|rate| rate as f32 / 256.0);
        if frame >= 1740 {
            farthest = farthest.max(length([0, 1, 2].map(|i| ball[i] - target[i])));
        }
    }
    farthest
}

#[test]
fn a_loop_near_a_resonance_settles() {
    for (hz, damping) in [(3.0, 0.05), (1.5, 0.03), (0.9, 0.05), (0.8, 0.05), (0.7, 0.05)] {
        let farthest = farthest_at_the_end(hz, damping);
        assert!(farthest < 10.0, "{hz} Hz: still {farthest} mm away");
    }
}
