//! Where the ball is when single pictures are not to be trusted, and when a target is reached or
//! run away from.

use plumb_protocol::config::{Growth, Reached};
use plumb_protocol::units::{Micros, Point};

/// A position that is farther than this from the last one, along an axis, is strange, µm: at 400
/// steps/s and 0.94 mm a step the ball goes 12.5 mm from a picture to the next, and noise of 6 mm
/// is at four standard deviations.
const STRANGE: i32 = 25_000;
/// So many strange positions in a row are passed over; the next says where the ball is.
const PASSED_OVER: u8 = 2;

/// A first-order filter over positions: each moves it a quarter of the way, which lets 0.38 of
/// white noise through (√(a/(2 - a)), a = 1/4) and lags by three pictures. Single outliers are
/// passed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Filter {
    /// Micrometres with 4 fraction bits; within ±4 m, so 26 bits.
    state: Option<[i32; 3]>,
    /// The last position that was not strange, µm.
    last: [i32; 3],
    /// Positions in a row that were.
    strange: u8,
}

impl Filter {
    /// Takes in a position within ±4 m; the first is taken as it is.
    pub fn update(&mut self, position: [i32; 3]) {
        if self.passes_over(position) {
            return;
        }
        (self.last, self.strange) = (position, 0);
        let position = position.map(|p| p << 4);
        self.state = Some(match self.state {
            None => position,
            Some(state) => [0, 1, 2].map(|i| state[i] + ((position[i] - state[i]) >> 2)),
        });
    }

    fn passes_over(&mut self, position: [i32; 3]) -> bool {
        let strange = (0..3).any(|i| (position[i] - self.last[i]).abs() > STRANGE);
        if self.state.is_none() || !strange || self.strange >= PASSED_OVER {
            return false;
        }
        self.strange += 1;
        true
    }

    /// The filtered position, whole micrometres; `None` before the first.
    pub fn position(&self) -> Option<[i32; 3]> {
        self.state.map(|s| s.map(|p| (p + 8) >> 4))
    }

    /// How far the last position that was taken in is off the filtered one, µm, within ±8 m; zero
    /// before the first.
    pub fn off(&self) -> [i32; 3] {
        self.position().map_or([0; 3], |p| [0, 1, 2].map(|i| self.last[i] - p[i]))
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

/// Counts pictures near the target in a row: one raw picture is wrong in 25 % of runs, this in none
/// of 1000 (docs/understand/method.md). What the filter smoothes away of a ball that swings is seen
/// by how far positions are off it: white noise is off to either side without memory, and the
/// product of two that follow each other is zero or less in the mean; of a swing it is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Arrival {
    frames: u8,
    /// How far the last position was off the filtered one, µm.
    off: [i32; 3],
    /// Mean of the products, µm².
    swing: i64,
}

impl Arrival {
    /// Takes in the filtered |e| (µm) after a picture, and how far its position is off
    /// ([`Filter::off`]); whether the target counts as reached now.
    pub fn update(&mut self, filtered: u32, off: [i32; 3], rule: &Reached) -> bool {
        let radius = rule.radius.0.unsigned_abs();
        // 0.8 of the radius, so that noise at the rim does not count; radius <= 1 m, so 23 bits.
        let near = filtered * 5 <= radius * 4;
        self.frames = if near { self.frames.saturating_add(1) } else { 0 };
        self.note_swing(off, radius);
        self.frames >= rule.frames && self.at_rest(filtered, radius)
    }

    /// Over sixteen pictures, half a second. A product counts as radius²/2 at most: what was on the
    /// way is soon forgotten, in the time that the pictures are counted.
    fn note_swing(&mut self, off: [i32; 3], radius: u32) {
        let most = i64::from(radius) * i64::from(radius) / 2;
        let product: i64 = (0..3).map(|i| i64::from(off[i]) * i64::from(self.off[i])).sum();
        self.swing += (product.clamp(-most, most) - self.swing) / 16;
        self.off = off;
    }

    /// Whether the filtered |e| and the swing about it are together within 0.8 of the radius. An
    /// amplitude's square is twice its mean, and half of it is left beside the filter at 1.4 Hz,
    /// where a ball on springs or on two cables may swing.
    fn at_rest(&self, filtered: u32, radius: u32) -> bool {
        let square = |v: u32| i64::from(v) * i64::from(v);
        25 * (square(filtered) + 4 * self.swing.max(0)) <= 16 * square(radius)
    }
}

/// Notices an error that stays above its smallest value so far: the ball is driven away from its
/// target.
///
/// The smallest value is that of the nearest position so far, seen from where the target is now. So
/// a change of the target neither disarms the guard nor sets it off, however often targets come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Divergence {
    nearest: Option<Nearest>,
    /// When the error began to stay above the margin.
    since: Option<Micros>,
}

/// The position nearest to the target so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Nearest {
    /// µm.
    position: [i32; 3],
    /// The target that `error` belongs to.
    target: Point,
    /// Distance between the two, µm.
    error: u32,
}

impl Nearest {
    /// Returns the same position with its distance from `target`.
    fn seen_from(self, target: Point) -> Self {
        if self.target == target {
            return self;
        }
        Self { target, error: magnitude(error(self.position, target)), ..self }
    }
}

impl Divergence {
    /// Takes in the filtered `position` after a picture, and its distance from `target` (µm).
    /// Returns whether the error has been beyond the margin for too long.
    pub fn update(
        &mut self,
        now: Micros,
        position: [i32; 3],
        error: u32,
        target: Point,
        rule: &Growth,
    ) -> bool {
        let here = Nearest { position, target, error };
        let before = self.nearest.map_or(here, |nearest| nearest.seen_from(target));
        let nearest = if error <= before.error { here } else { before };
        self.nearest = Some(nearest);
        if error <= nearest.error.saturating_add(rule.margin.0.unsigned_abs()) {
            self.since = None;
            return false;
        }
        let since = *self.since.get_or_insert(now);
        now.since(since) >= u64::from(rule.time.0) * 1000
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_protocol::units::Micrometres;

    #[test]
    fn outliers_are_passed_over_and_a_true_jump_is_not() {
        let mut filter = Filter::default();
        let (home, away) = ([0, 0, -500_000], [0, 50_000, -500_000]);
        for ball in [home, home, away, home, away, away, home] {
            filter.update(ball);
            assert_eq!(filter.position(), Some(home));
        }
        for _ in 0..30 {
            filter.update(away);
        }
        assert!(filter.position().is_some_and(|p| (p[1] - away[1]).abs() < 100));
    }

    /// The picture at which a ball that comes in ten pictures from 100 mm away, and then is at `x`
    /// (µm, of the picture's number), has reached 0 within 10 mm; at most 300.
    fn reached_at(x: impl Fn(i32) -> i32) -> Option<i32> {
        let rule = Reached { radius: Micrometres(10_000), frames: 10 };
        let (mut filter, mut arrival) = (Filter::default(), Arrival::default());
        (0..300).find(|k| {
            filter.update([x(*k) + (100_000 - 10_000 * k).max(0), 0, 0]);
            let filtered = filter.position().map_or(u32::MAX, magnitude);
            arrival.update(filtered, filter.off(), &rule)
        })
    }

    #[test]
    fn a_ball_that_swings_by_its_target_has_not_reached_it() {
        // 3.75 Hz at 30 pictures/s, of which the filter leaves a third.
        const EIGHTHS: [i32; 8] = [0, 71, 100, 71, 0, -71, -100, -71];
        let swing = |amplitude: i32| move |k: i32| amplitude * EIGHTHS[k as usize % 8] / 100;
        assert_eq!(reached_at(swing(15_000)), None);
        assert!(reached_at(swing(3_000)).is_some_and(|k| k < 35));
        assert_eq!(
            reached_at(|k| swing((100_000 - 1_000 * k).max(0))(k)).map(|k| k > 85),
            Some(true)
        );
    }

    #[test]
    fn noise_from_picture_to_picture_delays_nothing() {
        assert!(reached_at(|k| if k % 2 == 0 { 6_000 } else { -6_000 }).is_some_and(|k| k < 35));
    }
}
