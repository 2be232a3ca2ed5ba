//! Matrices of three rows and columns in f32.

use crate::law::signs::SIGNS;
pub(super) use crate::vector::{Vector, dot, length, scaled};

/// A matrix by its rows.
pub(super) type Matrix = [Vector; 3];

/// Returns m v.
pub(super) fn along(m: &Matrix, v: Vector) -> Vector {
    m.map(|row| dot(row, v))
}

/// Returns m' v.
pub(super) fn transposed_times(m: &Matrix, v: Vector) -> Vector {
    [0, 1, 2].map(|k| m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2])
}

/// Returns the largest magnitude of the entries.
pub(super) fn largest(v: Vector) -> f32 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// Returns J with every entry of Σ's sign and at least a hundredth of the largest.
pub(super) fn projected(j: &Matrix) -> Matrix {
    let least = j.iter().flatten().fold(0.0, |m: f32, v| m.max(v.abs())) / 100.0;
    [0, 1, 2].map(|i| {
        [0, 1, 2].map(|k| match SIGNS[i][k] {
            0 => j[i][k],
            sign => sign as f32 * (sign as f32 * j[i][k]).max(least),
        })
    })
}

/// Returns the matrix of cofactors, and the determinant.
fn cofactors(m: &Matrix) -> (Matrix, f32) {
    const OTHERS: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];
    let cofactors = [0, 1, 2].map(|r: usize| {
        [0, 1, 2].map(|c: usize| {
            let ([a, b], [x, y]) = (OTHERS[r], OTHERS[c]);
            m[a][x] * m[b][y] - m[a][y] * m[b][x]
        })
    });
    (cofactors, dot(m[0], cofactors[0]))
}

/// Solves m v = e; `None` where det m is not above zero. For a matrix of the signs Σ it is.
pub(super) fn solve(m: &Matrix, e: Vector) -> Option<Vector> {
    let (cofactors, det) = cofactors(m);
    (det > 1e-12).then(|| scaled(transposed_times(&cofactors, e), 1.0 / det))
}

/// Returns the inverse. The magnitude of the determinant is 10⁻³ at least: three unit vectors
/// may lie almost in a plane.
pub(super) fn inverse(m: &Matrix) -> Matrix {
    let (cofactors, det) = cofactors(m);
    let scale = 1.0 / if det < 0.0 { det.min(-1e-3) } else { det.max(1e-3) };
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| cofactors[c][r] * scale))
}
