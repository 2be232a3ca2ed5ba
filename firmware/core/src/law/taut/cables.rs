//! Directions, lengths and derivatives of the cables at an estimate of the geometry.

use super::geometry::{Matrix, Vector, along, dot, inverse, length, scaled};
use super::prior::{N, STEP};

/// Cables at a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cables {
    /// Unit vectors from each motor to the ball.
    pub(super) units: Matrix,
    /// Lengths, mm.
    pub(super) lengths: Vector,
    /// Velocity of the ball over the rates of the cable lengths.
    pub(super) j: Matrix,
    /// Cable of a step, mm.
    pub(super) step: f32,
}

/// Returns the vectors from each motor to the ball, mm.
pub(super) fn cable_vectors(x: &[f32; N]) -> Matrix {
    [0, 1, 2].map(|k| [0, 1, 2].map(|c| x[c] - x[3 + 3 * k + c]))
}

impl Cables {
    /// Computes the cables at the state `x`.
    pub(super) fn new(x: &[f32; N]) -> Self {
        let from = cable_vectors(x);
        let lengths = from.map(|v| length(v).max(1.0));
        let units = [0, 1, 2].map(|k| scaled(from[k], 1.0 / lengths[k]));
        Self { units, lengths, j: inverse(&units), step: libm::expf(x[STEP]) }
    }
}

/// Derivative of the ball's movement with respect to the state when the motors turn: F = J G. Row k
/// of G is -w_k at the ball, w_k at motor k, and the cable paid out at ln s: seven of thirteen
/// entries.
pub(super) struct Gradient {
    /// w_k: movement of the ball across cable k, over its length.
    pub(super) bends: Matrix,
    /// Cable that each motor pays out, mm.
    pub(super) paid: Vector,
}

impl Gradient {
    /// Computes the derivative for motors that turn by `d` steps.
    pub(super) fn new(cables: &Cables, d: Vector) -> Self {
        let paid = scaled(d, cables.step);
        let moved = along(&cables.j, paid);
        let bends = [0, 1, 2].map(|k| {
            let unit = cables.units[k];
            // Along the cable the ball moves by the cable paid out.
            let part = dot(unit, moved);
            scaled([0, 1, 2].map(|c| moved[c] - part * unit[c]), 1.0 / cables.lengths[k])
        });
        Self { bends, paid }
    }
}
