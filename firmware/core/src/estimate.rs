//! Where the ball is when single pictures are not to be trusted, and when a target is reached or run away from.

use plumb_protocol::config::{Growth, Reached};
use plumb_protocol::units::{Micros, Point};

/// A first-order filter over positions: each moves it a quarter of the way, which lets 0.38 of white noise through
/// (√(a/(2 - a)), a = 1/4) and lags by three pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Filter {
    /// Micrometres with 4 fraction bits; within ±4 m, so 26 bits.
    state: Option<[i32; 3]>,
}

impl Filter {
    /// Takes in a position within ±4 m; the first is taken as it is.
    pub fn update(&mut self, position: [i32; 3]) {
        let position = position.map(|p| p << 4);
        self.state = Some(match self.state {
            None => position,
            Some(state) => [0, 1, 2].map(|i| state[i] + ((position[i] - state[i]) >> 2)),
        });
    }

    /// The filtered position, whole micrometres; `None` before the first.
    pub fn position(&self) -> Option<[i32; 3]> {
        self.state.map(|s| s.map(|p| (p + 8) >> 4))
    }
}

/// e = `position` - `target`, µm; both within ±4 m.
pub fn error(position: [i32; 3], target: Point) -> [i32; 3] {
    let target = target.micrometres();
    [0, 1, 2].map(|i| position[i] - target[i])
}

/// |e| in whole micrometres, rounded down; e within ±8 m a coordinate, so 24 bits.
pub fn magnitude(e: [i32; 3]) -> u32 {
    let squares: u64 = e.iter().map(|c| u64::from(c.unsigned_abs()).pow(2)).sum();
    squares.isqrt() as u32
}

/// Counts pictures near the target in a row: one raw picture is wrong in 25 % of runs, this in none of 1000
/// (docs/control.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Arrival {
    frames: u8,
}

impl Arrival {
    /// Takes in the filtered |e| (µm) after a picture; whether the target counts as reached now.
    pub fn update(&mut self, filtered: u32, rule: &Reached) -> bool {
        // 0.8 of the radius, so that noise at the rim does not count; radius <= 1 m, so 23 bits.
        let near = filtered * 5 <= rule.radius.0.unsigned_abs() * 4;
        self.frames = if near { self.frames.saturating_add(1) } else { 0 };
        self.frames >= rule.frames
    }
}

/// Notices an error that stays above its smallest value so far: the ball is driven away, not home.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Divergence {
    least: Option<u32>,
    since: Option<Micros>,
}

impl Divergence {
    /// Takes in the filtered |e| (µm) after a picture; whether it has kept growing for too long.
    pub fn update(&mut self, now: Micros, filtered: u32, rule: &Growth) -> bool {
        let least = self.least.map_or(filtered, |least| least.min(filtered));
        self.least = Some(least);
        if filtered <= least.saturating_add(rule.margin.0.unsigned_abs()) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}
