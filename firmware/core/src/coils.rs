//! Commutation: the drive of a motor's two coils at a position.
//!
//! Four full steps are a turn of the field. Coil 0 gets its cosine, coil 1 its sine, so paying out
//! turns the field from coil 0 to coil 1. With full steps both coils are on at each, for more
//! torque.

/// Positions (Q4 steps) in a turn of the field.
const TURN: i32 = 64;

/// Positions in a quarter turn: a full step.
const QUARTER: usize = 16;

/// Drive of the coils over a turn of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Commutation {
    quarter: [u16; QUARTER + 1],
}

impl Commutation {
    /// Creates the commutation from the sine of 0 to 90° in steps of 90°/16, times the highest
    /// drive; `quarter[16]` is the highest drive itself.
    pub const fn new(quarter: [u16; QUARTER + 1]) -> Self {
        Self { quarter }
    }

    /// Returns the signed drive of both coils at `position` (Q4 steps), for `microsteps` in a full
    /// step.
    pub fn at(&self, position: i32, microsteps: u8) -> [i32; 2] {
        let [cosine, sine] = [TURN / 4, 0].map(|lead| lead + position);
        if microsteps > 1 {
            return [self.sine(cosine), self.sine(sine)];
        }
        // Half a step further both coils have the same drive: both are fully on.
        let full = i32::from(self.quarter[QUARTER]);
        [cosine, sine].map(|angle| self.sine(angle + TURN / 8).signum() * full)
    }

    fn sine(&self, angle: i32) -> i32 {
        let angle = angle.rem_euclid(TURN) as usize;
        let (half, within) = (angle / (2 * QUARTER), angle % (2 * QUARTER));
        let magnitude =
            i32::from(self.quarter[if within > QUARTER { 2 * QUARTER - within } else { within }]);
        if half == 0 { magnitude } else { -magnitude }
    }
}
