//! Prior of the filters' state, before the first measurement.

use super::geometry::Vector;

/// Entries of a filter's state: p (0..3), M_A, M_B, M_C (3..12), ln s, and the delay.
pub(super) const N: usize = 14;
/// Index of ln s; s is the cable of a step, mm.
pub(super) const STEP: usize = 12;
/// Index of the measurements' delay beyond their age, in frame times
/// ([`crate::law::MOTOR_SAMPLE_US`]).
pub(super) const DELAY: usize = 13;

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
    /// Delay, frame times: 50 ms.
    delay: f32,
}

const SD: PriorSd = PriorSd { level: 200.0, height: 200.0, own: 20.0, ln_step: 0.3, delay: 1.5 };

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
        let middle = [0, 1, 2].map(|i| (ball[i] + target[i]) / 2.0);
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
        for i in 0..3 {
            p[i][i] = variance[i];
            for k in 0..3 {
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
        p[DELAY][DELAY] = SD.delay * SD.delay;
        p
    }
}
