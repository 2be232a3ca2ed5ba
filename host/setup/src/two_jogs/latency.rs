//! Latency of a camera, from pictures of a ball that a motor moves.

use nalgebra::Vector2;

/// What is seen while a motor turns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moving {
    /// Pictures: time stamp, seconds, and where the ball is seen, pixels.
    pub pictures: Vec<(f64, Vector2<f64>)>,
    /// Turn of the motor from the first jog on, in the order of time: time, seconds on the same
    /// clock, and full steps, + pays out.
    pub turned: Vec<(f64, f64)>,
}

impl Moving {
    /// Adds what is seen during the next jog of the same motor, whose turn begins at 0.
    pub(super) fn extend(&mut self, next: Self) {
        let before = self.turned.last().map_or(0.0, |(_, steps)| *steps);
        self.pictures.extend(next.pictures);
        self.turned.extend(next.turned.into_iter().map(|(time, steps)| (time, before + steps)));
    }

    /// Returns the turn at a time, full steps; that of the first or last sample before or after
    /// them.
    fn turn_at(&self, time: f64) -> f64 {
        let after = self.turned.partition_point(|(at, _)| *at <= time);
        match (after.checked_sub(1).and_then(|k| self.turned.get(k)), self.turned.get(after)) {
            (Some((t0, s0)), Some((t1, s1))) => s0 + (s1 - s0) * (time - t0) / (t1 - t0),
            (Some((_, steps)), None) | (None, Some((_, steps))) => *steps,
            (None, None) => 0.0,
        }
    }
}

/// Largest latency that is looked for, milliseconds.
const MAX_MS: i32 = 300;

/// Returns the time by which pictures are later than their time stamps, seconds: the one with the
/// least squares of p - p₀ - J s(t - τ), in whole milliseconds. `jogs` has for each motor its
/// column J (pixels a step), the ball's place p₀ before (pixels), and what was seen.
pub fn latency_s(jogs: &[(Vector2<f64>, Vector2<f64>, Moving)]) -> f64 {
    let squares = |ms: i32| -> f64 {
        let latency = f64::from(ms) * 1e-3;
        let of_jog = |(column, begin, moving): &(Vector2<f64>, Vector2<f64>, Moving)| {
            let square = |(time, seen): &(f64, Vector2<f64>)| {
                (seen - begin - column * moving.turn_at(time - latency)).norm_squared()
            };
            moving.pictures.iter().map(square).sum::<f64>()
        };
        jogs.iter().map(of_jog).sum()
    };
    let best = (0..=MAX_MS).map(|ms| (ms, squares(ms))).min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(0.0, |(ms, _)| f64::from(ms) * 1e-3)
}
