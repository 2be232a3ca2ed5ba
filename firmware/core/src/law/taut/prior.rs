//! What is taken for granted of a rig before anything is seen of it.

use super::geometry::Vector;

/// A filter's state: p, M_A, M_B, M_C, ln s.
pub(super) const N: usize = 13;
/// Where ln s is.
pub(super) const STEP: usize = 12;

/// From the ball to each motor, mm: the mean of docs/control.md's population, triangles of 1 m. z is the guess's own.
const OFFSETS: [f32; 9] = [330.0, 500.0, 0.0, 330.0, -500.0, 0.0, -670.0, 0.0, 0.0];
/// Standard deviations of these (the population's are 230 to 280), of the height of all motors, of each one's own (mm), and of ln s
/// (the population's is 0.48, and there are two guesses of it).
const ANYWHERE: f32 = 250.0;
const HEIGHT: f32 = 200.0;
const OWN: f32 = 20.0;
const LN_STEP: f32 = 0.4;

/// What a filter begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Guess {
    /// Motors above the ball, mm.
    pub(super) height: f32,
    /// The triangle's size, over [`OFFSETS`].
    pub(super) width: f32,
    /// Cable of a step, mm.
    pub(super) step: f32,
}

impl Guess {
    /// State and covariance with the ball at `ball` (mm), of `variance` (mm²). Motors are at about one height, A and B at
    /// about one x.
    pub(super) fn prior(&self, ball: Vector, variance: Vector) -> ([f32; N], [[f32; N]; N]) {
        let mut x = [0.0; N];
        x[..3].copy_from_slice(&ball);
        for i in 0..9 {
            x[3 + i] = ball[i % 3] + if i % 3 == 2 { self.height } else { self.width * OFFSETS[i] };
        }
        x[STEP] = libm::logf(self.step);
        let anywhere = (self.width * ANYWHERE) * (self.width * ANYWHERE);
        let mut p = [[0.0; N]; N];
        for i in 0..3 {
            p[i][i] = variance[i];
            for k in 0..3 {
                p[5 + 3 * i][5 + 3 * k] = HEIGHT * HEIGHT;
            }
            p[5 + 3 * i][5 + 3 * i] += OWN * OWN;
            p[3 + 3 * i][3 + 3 * i] = anywhere;
            p[4 + 3 * i][4 + 3 * i] = anywhere;
        }
        p[3][6] = anywhere;
        p[6][3] = anywhere;
        p[3][3] += OWN * OWN;
        p[6][6] += OWN * OWN;
        p[STEP][STEP] = LN_STEP * LN_STEP;
        (x, p)
    }
}
