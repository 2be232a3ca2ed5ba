//! What the bank is to do with pictures, good and bad.

use super::Seen;
use super::bank::Bank;
use super::geometry::{Vector, along, length};

fn seen(ball: Vector, motors: Vector) -> Seen {
    Seen { ball, variances: [4.0, 1.0, 1.0], motors }
}

/// How far the ball's estimate is from `ball`, mm.
fn off(bank: &Bank, ball: Vector) -> f32 {
    let believed = bank.belief().ball;
    length([0, 1, 2].map(|i| believed[i] - ball[i]))
}

#[test]
fn a_strange_picture_is_passed_over_and_the_third_in_a_row_is_believed() {
    let (home, away) = ([0.0, 0.0, -500.0], [0.0, 200.0, -500.0]);
    let mut bank = Bank::new(&seen(home, [0.0; 3]));
    for _ in 0..10 {
        bank.update(&seen(home, [0.0; 3]));
    }
    for _ in 0..2 {
        bank.update(&seen(away, [0.0; 3]));
        assert!(off(&bank, home) < 1e-3, "moved by {}", off(&bank, home));
    }
    bank.update(&seen(away, [0.0; 3]));
    assert!(off(&bank, away) < 5.0, "still {} away", off(&bank, away));
}

#[test]
fn motion_that_is_seen_tells_how_far_a_step_goes() {
    // Motors A and B pay out together; the ball falls and goes to C's side by what no guess says.
    let per_step = [-0.5, 0.0, -0.3];
    let mut bank = Bank::new(&seen([0.0, 0.0, -500.0], [0.0; 3]));
    for k in 1..60 {
        let n = k as f32 * 2.0;
        bank.update(&seen([per_step[0] * n, 0.0, per_step[2] * n - 500.0], [n, n, 0.0]));
    }
    let learnt = along(&bank.belief().j, [1.0, 1.0, 0.0]);
    let error = length([0, 1, 2].map(|i| learnt[i] - per_step[i]));
    assert!(error < 0.1 * length(per_step), "{learnt:?} for {per_step:?}");
}
