//! The rig's geometry as the filters estimate it: the entries of their state with the prior, the
//! cables at a state, and matrices of three rows and columns.

use plumb_protocol::dimension::{AXES, MOTORS, PerAxis, PerMotor};

use crate::law::sign::signs;
use crate::vector::{per_axis, per_motor};

pub(super) use crate::vector::{Vector, dot, length, scaled};

/// Entries of a filter's state: p (0..3), M_A, M_B, M_C (3..12), ln s, and the delay.
pub(super) const N: usize = 14;

/// Index of ln s; s is the cable of a step, mm.
pub(super) const STEP: usize = 12;

/// Index of the measurements' delay beyond their age, in frame times
/// ([`crate::law::MOTOR_SAMPLE_US`]).
pub(super) const DELAY: usize = 13;

/// A matrix by its rows.
pub(super) type Matrix = PerAxis<Vector>;

/// Returns m v.
pub(super) fn along(m: &Matrix, v: Vector) -> Vector {
    m.map(|row| dot(row, v))
}

/// Returns m' v.
pub(super) fn transposed_times(m: &Matrix, v: Vector) -> Vector {
    per_motor(|k| m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2])
}

/// Returns the largest magnitude of the entries.
pub(super) fn largest(v: Vector) -> f32 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// Returns J with every entry of Σ's sign and at least a hundredth of the largest.
pub(super) fn projected(j: &Matrix) -> Matrix {
    const SIGNS: PerAxis<PerMotor<i32>> = signs(false);
    let least = j.iter().flatten().fold(0.0, |m: f32, v| m.max(v.abs())) / 100.0;
    per_axis(|i| {
        per_motor(|k| match SIGNS[i][k] {
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
#[inline(never)]
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
    per_motor(|k| per_axis(|c| x[c] - x[3 + 3 * k + c]))
}

impl Cables {
    /// Computes the cables at the state `x`.
    pub(super) fn new(x: &[f32; N]) -> Self {
        let from = cable_vectors(x);
        let lengths = from.map(|v| length(v).max(1.0));
        let units = per_motor(|k| scaled(from[k], 1.0 / lengths[k]));
        Self { units, lengths, j: inverse(&units), step: libm::expf(x[STEP]) }
    }
}

/// Derivative of the ball's movement with respect to the state when the motors turn: F = J G. Row k
/// of G is -w_k at the ball, w_k at motor k, and the cable paid out at ln s: seven of its
/// [`N`] entries.
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
        let bends = per_motor(|k| {
            let unit = cables.units[k];
            // Along the cable the ball moves by the cable paid out.
            let part = dot(unit, moved);
            scaled(per_axis(|c| moved[c] - part * unit[c]), 1.0 / cables.lengths[k])
        });
        Self { bends, paid }
    }
}

/// Mean offset of each motor from the middle of start and target, mm: the mean of
/// docs/understand/method.md's population, triangles of 1 m. z comes from the guess. Motors stand
/// about start and target, so the middle between both is nearer to them than the ball.
const OFFSETS: [f32; 9] = [330.0, 500.0, 0.0, 330.0, -500.0, 0.0, -670.0, 0.0, 0.0];

/// Standard deviations of the prior.
struct PriorSd {
    /// Motors in x and y, mm; the population's are 175 to 241.
    level: f32,
    /// Height of all motors, mm.
    height: f32,
    /// Deviation of each motor from the others, mm.
    own: f32,
    /// ln s; the population's is 0.48, and the guesses have two values of s.
    ln_step: f32,
}

const SD: PriorSd = PriorSd { level: 200.0, height: 200.0, own: 20.0, ln_step: 0.3 };

/// Standard deviation of a delay of which nothing is known, frame times: 50 ms.
pub(super) const DELAY_SD: f32 = 1.5;

/// Mean height of the motors above the middle of start and target, mm. They are 100 to 1000 mm
/// above both.
const MEAN_HEIGHT_MM: f32 = 550.0;
/// Range of the motors' heights, mm. A difference in height between start and target leaves that
/// much less of it.
const HEIGHT_RANGE_MM: f32 = 900.0;
/// Least share of the range that is left.
const MIN_ROOM: f32 = 0.2;

/// First guess of a filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Guess {
    /// Height of the motors above the middle of a level way, mm.
    pub(super) height: f32,
    /// Size of the triangle of motors, as a factor on [`OFFSETS`].
    pub(super) width: f32,
    /// Cable of a step, mm.
    pub(super) step: f32,
}

impl Guess {
    /// Returns state and covariance with the ball at `ball` (mm), of `variance` (mm²), on its way
    /// to `target` (mm). The motors are at about one height, A and B at about one x.
    pub(super) fn prior(
        &self,
        ball: Vector,
        variance: Vector,
        target: Vector,
    ) -> ([f32; N], [[f32; N]; N]) {
        let middle = per_axis(|i| (ball[i] + target[i]) / 2.0);
        let room = (1.0 - (target[2] - ball[2]).abs() / HEIGHT_RANGE_MM).max(MIN_ROOM);
        let height = MEAN_HEIGHT_MM + room * (self.height - MEAN_HEIGHT_MM);
        let mut x = [0.0; N];
        x[..3].copy_from_slice(&ball);
        for i in 0..9 {
            x[3 + i] = middle[i % 3] + if i % 3 == 2 { height } else { self.width * OFFSETS[i] };
        }
        x[STEP] = libm::logf(self.step);
        (x, self.covariance(variance, room))
    }

    /// Returns the covariance of the prior.
    fn covariance(&self, variance: Vector, room: f32) -> [[f32; N]; N] {
        let level = (self.width * SD.level) * (self.width * SD.level);
        let mut p = [[0.0; N]; N];
        for i in 0..AXES {
            p[i][i] = variance[i];
            for k in 0..MOTORS {
                p[5 + 3 * i][5 + 3 * k] = (room * SD.height) * (room * SD.height);
            }
            p[5 + 3 * i][5 + 3 * i] += SD.own * SD.own;
            p[3 + 3 * i][3 + 3 * i] = level;
            p[4 + 3 * i][4 + 3 * i] = level;
        }
        p[3][6] = level;
        p[6][3] = level;
        p[3][3] += SD.own * SD.own;
        p[6][6] += SD.own * SD.own;
        p[STEP][STEP] = SD.ln_step * SD.ln_step;
        p[DELAY][DELAY] = DELAY_SD * DELAY_SD;
        p
    }
}
