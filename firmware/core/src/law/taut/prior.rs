//! What is taken for granted of a rig before anything is seen of it.

use super::geometry::Vector;

/// A filter's state: p, M_A, M_B, M_C, ln s, and how much later pictures are than told.
pub(super) const N: usize = 14;
/// Where ln s is.
pub(super) const STEP: usize = 12;
/// Where that lateness is, in pictures' times ([`crate::law::MOTOR_SAMPLE_US`]).
pub(super) const LATE: usize = 13;

/// From the middle of the way to each motor, mm: the mean of docs/understand/method.md's
/// population, triangles of 1 m. z is the guess's own. Motors are about start and target, wherever
/// these are, so that the middle between the two says more of where than the ball alone does.
const OFFSETS: [f32; 9] = [330.0, 500.0, 0.0, 330.0, -500.0, 0.0, -670.0, 0.0, 0.0];
/// Standard deviations of these (the population's are 175 to 241), of the height of all motors, of
/// each one's own (mm), and of ln s (the population's is 0.48, and there are two guesses of it).
/// Lateness is none in the mean, and 50 ms are nothing strange.
const ANYWHERE: f32 = 200.0;
const HEIGHT: f32 = 200.0;
const OWN: f32 = 20.0;
const LN_STEP: f32 = 0.3;
const LATENESS: f32 = 1.5;
/// Motors are 100 to 1000 mm above both start and target, mm above the middle in the mean: the
/// farther one of them is above the other, the less room there is for that, down to a share.
const MEAN_HEIGHT: f32 = 550.0;
const HEIGHTS: f32 = 900.0;
const LEAST_ROOM: f32 = 0.2;

/// What a filter begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Guess {
    /// Motors above the middle of a level way, mm.
    pub(super) height: f32,
    /// The triangle's size, over [`OFFSETS`].
    pub(super) width: f32,
    /// Cable of a step, mm.
    pub(super) step: f32,
}

impl Guess {
    /// State and covariance with the ball at `ball` (mm), of `variance` (mm²), on its way to
    /// `target` (mm). Motors are at about one height, A and B at about one x.
    pub(super) fn prior(
        &self,
        ball: Vector,
        variance: Vector,
        target: Vector,
    ) -> ([f32; N], [[f32; N]; N]) {
        let middle = [0, 1, 2].map(|i| (ball[i] + target[i]) / 2.0);
        let room = (1.0 - (target[2] - ball[2]).abs() / HEIGHTS).max(LEAST_ROOM);
        let height = MEAN_HEIGHT + room * (self.height - MEAN_HEIGHT);
        let mut x = [0.0; N];
        x[..3].copy_from_slice(&ball);
        for i in 0..9 {
            x[3 + i] = middle[i % 3] + if i % 3 == 2 { height } else { self.width * OFFSETS[i] };
        }
        x[STEP] = libm::logf(self.step);
        let anywhere = (self.width * ANYWHERE) * (self.width * ANYWHERE);
        let mut p = [[0.0; N]; N];
        for i in 0..3 {
            p[i][i] = variance[i];
            for k in 0..3 {
                p[5 + 3 * i][5 + 3 * k] = (room * HEIGHT) * (room * HEIGHT);
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
        p[LATE][LATE] = LATENESS * LATENESS;
        (x, p)
    }
}
