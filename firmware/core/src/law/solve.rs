//! Three linear equations in fixed point, with bits dropped where products would not fit.

use super::fixed_point::{excess_bits, times};

/// Bits of an entry of J for the determinant.
pub(super) const J_BITS: u32 = 14;
/// Bits of the right side.
const E_BITS: u32 = 17;
/// Fraction bits of a solution.
const SOLUTION_BITS: i32 = 8;
/// Fraction bits of J.
const J_FRACTION: i32 = 6;
/// Saturation of a solution: 2^18 steps in Q8.
const MAX_STEPS: i64 = 1 << 26;

/// Solves J n = e: returns motor steps in Q8 for J in Q6 µm/step and e in µm. Returns `None`
/// where det J is not above zero; for a matrix of the signs Σ it always is.
pub(super) fn solve(j: &[[i32; 3]; 3], e: [i32; 3]) -> Option<[i32; 3]> {
    let dropped_j = excess_bits(j.iter().flatten().copied(), J_BITS).max(0);
    let dropped_e = excess_bits(e.into_iter(), E_BITS).max(0);
    let j = j.map(|row| row.map(|v| i64::from(v >> dropped_j)));
    let e = e.map(|v| i64::from(v >> dropped_e));
    // Bits: 14 + 14 = 28, 29 the difference.
    let minor = |r: [usize; 2], c: [usize; 2]| {
        times(j[r[0]][c[0]], j[r[1]][c[1]]) - times(j[r[0]][c[1]], j[r[1]][c[0]])
    };
    const OTHERS: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];
    let cofactor = |r: usize, c: usize| minor(OTHERS[r], OTHERS[c]);
    // Bits: 14 + 29 = 43, 45 the sum.
    let det: i64 = (0..3).map(|c| times(j[0][c], cofactor(0, c))).sum();
    // J n = e <=> n = adj(J) e / det, and J = (scaled J) 2^(dropped_j - 6).
    let shift = SOLUTION_BITS + J_FRACTION - dropped_j + dropped_e;
    let (up, down) = (shift.clamp(0, 14), (shift - 14).max(0));
    let det = det >> down;
    if det <= 0 {
        return None;
    }
    Some([0, 1, 2].map(|c| {
        // Bits: 29 + 17 = 46, 48 the sum; 62 after the shift.
        let sum: i64 = (0..3).map(|r| times(cofactor(r, c), e[r])).sum();
        let scaled = if shift < 0 { sum >> -shift } else { sum << up };
        (scaled / det).clamp(-MAX_STEPS, MAX_STEPS) as i32
    }))
}
