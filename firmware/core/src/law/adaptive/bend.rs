//! The change of J as the ball moves.
//!
//! With the lengths L_k of the cables and their change c for a step, U J = c, where row k of U is
//! the unit vector from motor k to the ball. The derivative of this equation is
//!
//! ```text
//! dJ = J diag(c dn_k / L_k) - Σ_k J_k (J'dp)' / (c L_k)
//! ```
//!
//! with the motors' steps dn, the ball's movement dp and the columns J_k. Neither c nor L_k are
//! known. J tells c L over the rig's width, and the ball's depth over the rig's width; the width is
//! assumed. The rest of the change is process noise of the filters.

use crate::law::axis_kalman::MAX_TURN;
use crate::law::fixed_point::{movement, times};

/// Width of the motors' triangle in x and y, µm. Rigs that are half and twice as wide profit too;
/// on them the change is over- or underestimated.
const WIDTH_UM: i64 = 1_300_000;
/// Least width of the rig in J, Q6 µm/step: 20 µm/step.
const LEAST_J: i64 = 20 << 6;
/// Largest movement of the ball that counts, Q4 µm: 33 mm.
const MAX_MOVED: i64 = 1 << 19;
/// Largest relative change, Q20: a quarter.
const MAX_CHANGE: i64 = 1 << 18;

/// Returns the change of J (Q6 µm/step) while the motors turn by `turned` (Q4 steps).
pub(super) fn change(j: &[[i32; 3]; 3], turned: [i32; 3]) -> [[i32; 3]; 3] {
    let turned = turned.map(|d| i64::from(d.clamp(-MAX_TURN, MAX_TURN)));
    // Bits: 19 + 13, 34 the sum.
    let moved = j.map(|row| movement(row, turned).clamp(-MAX_MOVED, MAX_MOVED));
    let j = j.map(|row| row.map(i64::from));
    // The ball's movement for a step of all three motors: 21 bits.
    let lowered = j.map(|row| row.iter().sum::<i64>());
    // c L over the width: the mean of those by x and by y.
    let sideways = (2 * j[0][2].abs() + j[1][0].abs() + j[1][1].abs()) >> 2;
    let sideways = sideways.max(LEAST_J);
    let shortened = shortening(sideways, lowered[2]);
    // Relative changes in Q20.
    let stretched = [0, 1, 2].map(|k| {
        // Bits: 30 + 14; Q34 to Q20.
        (times(shortened, turned[k]) >> 14).clamp(-MAX_CHANGE, MAX_CHANGE)
    });
    let turned_away = [0, 1, 2].map(|k| {
        // Bits: 19 + 19, 40 the sum, 56 with the shift; over 19 + 21. Q26 over Q6.
        let along: i64 = (0..3).map(|i| times(j[i][k], moved[i])).sum();
        ((along << 16) / times(sideways, WIDTH_UM)).clamp(-MAX_CHANGE, MAX_CHANGE)
    });
    [0, 1, 2].map(|i| {
        [0, 1, 2].map(|k| {
            // Bits: 21 + 18, 40 the difference.
            let change = times(j[i][k], stretched[k]) - times(lowered[i], turned_away[k]);
            (change >> 20) as i32
        })
    })
}

/// Returns c / L, the relative change of a cable's length for a step, in Q30. A motor at the side
/// is a third of the squared width away in the square, so that L² is the depth's square and that.
fn shortening(sideways: i64, lowered: i64) -> i64 {
    // Bits: 42 + 14 over 42.
    let square = times(lowered, lowered);
    let flat = (square << 14) / (3 * times(sideways, sideways) + square);
    // Bits: 2 + 19 + 14 + 10; Q6 + Q14 + 10 bits.
    (times(3 * sideways, flat) << 10) / WIDTH_UM
}

#[cfg(test)]
mod tests {
    use super::*;

    type Matrix = [[f64; 3]; 3];

    /// Motors of a rig that is 1.3 m wide, and their cables for a step, mm.
    const MOTORS: Matrix = [[1300.0, 1300.0, 0.0], [1300.0, 0.0, 0.0], [0.0, 650.0, 0.0]];
    const STEP: f64 = 0.4;

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|i| a[i] * b[i]).sum()
    }

    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
    }

    /// Returns J at a place, mm/step.
    fn jacobian(ball: [f64; 3]) -> Matrix {
        let units = MOTORS.map(|motor| {
            let way = [0, 1, 2].map(|i| ball[i] - motor[i]);
            way.map(|w| w / dot(way, way).sqrt())
        });
        let across = [0, 1, 2].map(|k| cross(units[(k + 1) % 3], units[(k + 2) % 3]));
        let volume = dot(units[0], across[0]);
        [0, 1, 2].map(|i| [0, 1, 2].map(|k| STEP * across[k][i] / volume))
    }

    fn fixed(j: &Matrix) -> [[i32; 3]; 3] {
        j.map(|row| row.map(|v| (v * 64_000.0).round() as i32))
    }

    #[test]
    fn it_is_the_change_on_a_rig_of_the_assumed_width() {
        for turned in [[10, 0, 0], [0, -12, 6], [8, 8, 8], [-9, 10, 4]] {
            let ball = [870.0, 650.0, -600.0];
            let before = jacobian(ball);
            let moved = before.map(|row| dot(row, turned.map(f64::from)));
            let after = jacobian([0, 1, 2].map(|i| ball[i] + moved[i]));
            let change = change(&fixed(&before), turned.map(|d| d * 16));
            let (mut off, mut all) = (0.0, 0.0);
            for (i, k) in (0..9).map(|at| (at / 3, at % 3)) {
                let exact = (after[i][k] - before[i][k]) * 64_000.0;
                off += (f64::from(change[i][k]) - exact).powi(2);
                all += exact * exact;
            }
            assert!(off < 0.04 * all, "{turned:?}: {} of it is missing", (off / all).sqrt());
        }
    }

    #[test]
    fn it_is_bounded_and_none_for_motors_that_rest() {
        let largest = (1 << 19) - 1;
        for j in [[[0; 3]; 3], [[largest; 3]; 3], [[1, -1, largest], [0; 3], [-largest; 3]]] {
            assert_eq!(change(&j, [0; 3]), [[0; 3]; 3]);
            for turned in [i32::MAX, i32::MIN] {
                let changes = change(&j, [turned, -1, turned]);
                assert!(changes.iter().flatten().all(|c| c.abs() <= 1 << 20), "{changes:?}");
            }
        }
    }
}
