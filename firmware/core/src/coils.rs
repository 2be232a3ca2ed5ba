//! Which way and how strongly the two coils of a motor are driven at a position.
//!
//! Four full steps are a turn of the field. Coil 0 gets its cosine, coil 1 its sine, so paying out
//! lets the field turn from coil 0 to coil 1. Where the motor only ever stands on full steps both
//! coils are on at each, for more torque.

/// Positions (1/16 steps) in a turn of the field.
const TURN: i32 = 64;

/// Positions in a quarter of it: a full step.
const QUARTER: usize = 16;

/// The coils' drive over a turn of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Commutation {
    quarter: [u16; QUARTER + 1],
}

impl Commutation {
    /// From the sine of 0 to 90° in 1/16 of that, as a share of the highest drive; `quarter[16]` is
    /// that drive itself.
    pub const fn new(quarter: [u16; QUARTER + 1]) -> Self {
        Self { quarter }
    }

    /// The drive of both coils at `position` (1/16 steps), with `microsteps` in a step: + one way,
    /// - the other.
    pub fn at(&self, position: i32, microsteps: u8) -> [i32; 2] {
        let [cosine, sine] = [TURN / 4, 0].map(|lead| lead + position);
        if microsteps > 1 {
            return [self.sine(cosine), self.sine(sine)];
        }
        // Half a step on, where both are equal, and both fully on.
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
