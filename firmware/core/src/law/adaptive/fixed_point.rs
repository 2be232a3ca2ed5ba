//! Arithmetic in fixed point, which counts its bits: products, sizes, and three
//! linear equations.

use plumb_protocol::dimension::{MOTORS, PerAxis, PerMotor};

/// Multiplies without an overflow check, which would take the chip longer than the product. The
/// caller counts the bits.
pub(super) fn times(a: i64, b: i64) -> i64 {
    a.wrapping_mul(b)
}

/// Returns the ball's movement in one axis, µm, while the motors turn by `turned` steps. It has as
/// many fraction bits as `turned`. `row` is the row of J for the axis, Q6 µm/step. Before the
/// shift the sum has two bits more than a product.
pub(super) fn movement(row: PerMotor<i32>, turned: PerMotor<i64>) -> i64 {
    (0..MOTORS).map(|k| times(row[k].into(), turned[k])).sum::<i64>() >> 6
}

/// Returns |e|² in µm² for `e` in µm.
pub(super) fn squared_length(e: PerAxis<i32>) -> i64 {
    e.iter().map(|e| times((*e).into(), (*e).into())).sum()
}

/// Returns by how many bits the largest of `values` is longer than `bits`; negative where it is
/// shorter.
pub(super) fn excess_bits(values: impl Iterator<Item = i32>, bits: u32) -> i32 {
    let longest = values.map(|v| 32 - v.unsigned_abs().leading_zeros()).max().unwrap_or(0);
    longest as i32 - bits as i32
}

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
pub(super) fn solve(j: &PerAxis<PerMotor<i32>>, e: PerAxis<i32>) -> Option<PerMotor<i32>> {
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
