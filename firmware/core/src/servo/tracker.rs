//! The ball: its filtered position, its error, and when it counts as arrived at its target.

use plumb_protocol::config::Reached;
use plumb_protocol::dimension::{AXES, PerAxis};
use plumb_protocol::units::{Micros, Point};

use crate::vector::per_axis;

/// Largest plausible move of the ball along an axis between two positions, µm. At 400 steps/s and
/// 0.94 mm a step the ball moves 12.5 mm between two frames, and noise of 6 mm reaches the rest at
/// four standard deviations.
const MAX_MOVE_UM: i32 = 25_000;

/// Outliers in a row that the filter passes over. It takes in the next position: the ball has
/// moved.
const MAX_OUTLIERS: u8 = 2;

/// Tracker of the ball: its last position, and a filter over all positions.
///
/// The filter is of first order: each position moves it a quarter of the way. It lets 0.38 of white
/// noise through (√(a/(2 - a)), a = 1/4) and lags by three positions. It passes over single
/// outliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BallTracker {
    /// When the last frame with the ball inside the workspace was captured.
    captured: Option<Micros>,
    /// Position of the ball in it, µm.
    last: Option<PerAxis<i32>>,
    /// Frames in a row with the ball outside the workspace.
    outside: u8,
    /// State of the filter: µm with 4 fraction bits; within ±4 m, so 26 bits.
    state: Option<PerAxis<i32>>,
    /// Last position that the filter took in, µm.
    inlier: PerAxis<i32>,
    /// Positions in a row that the filter passed over.
    outliers: u8,
}

impl BallTracker {
    /// Takes in a position inside the workspace and within ±4 m, µm, from a frame captured at
    /// `captured`. The filter starts at the first position.
    pub fn update(&mut self, captured: Micros, position: PerAxis<i32>) {
        (self.captured, self.last) = (Some(captured), Some(position));
        self.outside = 0;
        if self.is_outlier(position) {
            self.outliers += 1;
            return;
        }
        (self.inlier, self.outliers) = (position, 0);
        let position = position.map(|p| p << 4);
        self.state = Some(match self.state {
            None => position,
            Some(state) => per_axis(|i| state[i] + ((position[i] - state[i]) >> 2)),
        });
    }

    fn is_outlier(&self, position: PerAxis<i32>) -> bool {
        let far = (0..AXES).any(|i| (position[i] - self.inlier[i]).abs() > MAX_MOVE_UM);
        self.state.is_some() && far && self.outliers < MAX_OUTLIERS
    }

    /// Returns when the last frame with the ball was captured.
    pub fn captured(&self) -> Option<Micros> {
        self.captured
    }

    /// Returns the last position, µm, unfiltered.
    pub fn last(&self) -> Option<PerAxis<i32>> {
        self.last
    }

    /// Returns the filtered position in whole micrometres; `None` before the first position.
    pub fn filtered(&self) -> Option<PerAxis<i32>> {
        self.state.map(|s| s.map(|p| (p + 8) >> 4))
    }

    /// Returns the last position that is no outlier, µm; the origin before the first one.
    pub fn inlier(&self) -> PerAxis<i32> {
        self.inlier
    }

    /// Counts a frame with the ball outside the workspace. Returns the number of such frames in a
    /// row.
    pub fn count_outside(&mut self) -> u8 {
        self.outside = self.outside.saturating_add(1);
        self.outside
    }

    /// Forgets the frames with the ball outside the workspace.
    pub fn clear_outside(&mut self) {
        self.outside = 0;
    }
}

/// Time for which the velocity counts, positions: 0.17 s at 30 Hz. A swing slower than 1 Hz may
/// pass for a ball at rest.
const AHEAD: i64 = 5;
/// Square of the standard deviations of the mean of a few positions that count: four of them.
const SQUARE_SIGMAS: i64 = 16;
/// The square of 0.88, in hundredths: within that share of the radius the ball is near its target.
const SQUARE_SHARE: i64 = 77;
/// Shares of the residuals' mean by which the position lags behind, 1 - α, and the velocity,
/// α - β/2.
const LAGS: [i32; 2] = [10, 5];
/// Mean square of the residuals of white noise, as a share of that of their distance from their
/// mean: 0.81, by simulation.
const OF_SCATTER: i64 = 13;
/// Unit of the three shares, as a shift: 1/16.
const SHARE_SHIFT: u32 = 4;
/// The residuals' mean shows a lag where its square is above s² by this share: above s²/8. White
/// noise has s²/14 there, by simulation.
const SIGNIFICANT: i64 = 8;
/// Share of the radius, as a shift: before the noise is known, its standard deviation is 1/4 of it.
const UNKNOWN_NOISE: u32 = 2;

/// Detector of the ball's arrival at its target: a sequential test on position, velocity and noise.
///
/// With n positions in a row near the target, the target counts as reached when
///
/// ```text
/// |p|² + (0.17 s · |v|)² + 16 s²/n  <=  (0.88 radius)²,    n >= the least number of positions
/// ```
///
/// p and v are the ball's distance from the target and its velocity: those of an α-β filter (α =
/// 3/8, β = 9/64), which does not lag behind a ball that moves evenly, and their lag behind one
/// whose velocity changes evenly. That lag follows from the mean m of the last residuals, where it
/// is more than their noise: (1 - α) m, and (α - β/2) m a position. s² is the mean square of the
/// residuals, their mean apart. The velocity rules out a ball that passes, and one that swings
/// about its target. The last term is the doubt that noise leaves: more noise takes more positions.
///
/// A rule that takes one raw position is wrong in 25 % of runs. How often this one is wrong is in
/// docs/understand/method.md.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ArrivalDetector {
    /// The filter; `None` before the first position.
    motion: Option<Motion>,
    /// Mean of the last residuals, about four: µm with 4 fraction bits.
    mean: PerAxis<i32>,
    /// Mean square of the residuals, their mean apart, µm².
    noise: i64,
    /// Positions near the target in a row.
    count: u8,
}

/// Position and velocity of the ball by an α-β filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Motion {
    /// Distance from the target along each axis: µm with 4 fraction bits, 28 bits and the sign.
    position: PerAxis<i32>,
    /// Its change from position to position, in the same unit; 27 bits and the sign.
    velocity: PerAxis<i32>,
}

impl Motion {
    /// Takes in e (µm, within ±8 m), and returns the residual: what the prediction lacked, in the
    /// unit of the position.
    fn update(&mut self, e: PerAxis<i32>) -> PerAxis<i32> {
        per_axis(|i| update_axis(&mut self.position[i], &mut self.velocity[i], e[i]))
    }
}

/// Does the work of [`Motion::update`] along one axis.
#[inline(never)]
fn update_axis(position: &mut i32, velocity: &mut i32, e: i32) -> i32 {
    let predicted = *position + *velocity;
    let residual = (e << 4) - predicted;
    *position = predicted + (residual >> 2) + (residual >> 3);
    *velocity += (residual >> 3) + (residual >> 6);
    residual
}

/// Returns the square of a length with 4 fraction bits, µm²: 50 bits.
#[inline(never)]
fn square(length: PerAxis<i32>) -> i64 {
    length.iter().map(|c| i64::from(c >> 4) * i64::from(c >> 4)).sum()
}

/// Returns `value` with its lag, the `share` (in 1/16) of the residuals' mean.
#[inline(never)]
fn with_lag(value: PerAxis<i32>, mean: PerAxis<i32>, share: i32) -> PerAxis<i32> {
    per_axis(|i| value[i] + share * (mean[i] >> SHARE_SHIFT))
}

impl ArrivalDetector {
    /// Takes in e of a position, µm, within ±8 m.
    pub fn observe(&mut self, e: PerAxis<i32>, rule: &Reached) {
        let square_radius = square_radius(rule);
        let Some(motion) = &mut self.motion else {
            self.motion = Some(Motion { position: e.map(|e| e << 4), velocity: [0; AXES] });
            self.noise = square_radius >> (2 * UNKNOWN_NOISE);
            return;
        };
        let residual = motion.update(e);
        let scatter = square(per_axis(|i| residual[i] - self.mean[i]));
        self.mean = per_axis(|i| self.mean[i] + ((residual[i] - self.mean[i]) >> 2));
        // It counts as the radius at most, so that the residuals of the way are soon forgotten.
        let scatter = (OF_SCATTER * scatter.min(square_radius)) >> SHARE_SHIFT;
        self.noise += (scatter - self.noise) >> 4;
        let is_near = 100 * square(motion.position) <= SQUARE_SHARE * square_radius;
        self.count = if is_near { self.count.saturating_add(1) } else { 0 };
    }

    /// Returns whether the target counts as reached with the last position.
    pub fn has_arrived(&self, rule: &Reached) -> bool {
        let Some(motion) = self.motion.filter(|_| self.count >= rule.frames.max(1)) else {
            return false;
        };
        let square_radius = square_radius(rule);
        let limit = SQUARE_SHARE * square_radius;
        let is_lagging = SIGNIFICANT * square(self.mean) > self.noise;
        let [lag, velocity_lag] = if is_lagging { LAGS } else { [0, 0] };
        // Beyond the radius it does not matter how far, and products stay within 64 bits.
        let off = square(with_lag(motion.position, self.mean, lag)).min(square_radius);
        let velocity = with_lag(motion.velocity, self.mean, velocity_lag);
        let ahead = square(velocity).min(square_radius) * AHEAD * AHEAD;
        if 100 * off.max(ahead) > limit {
            return false;
        }
        // By n times both sides: a division of 64 bits takes the chip long.
        let n = i64::from(self.count);
        100 * (n * (off + ahead) + SQUARE_SIGMAS * self.noise) <= n * limit
    }
}

/// Returns the square of the radius of a reached target, µm².
fn square_radius(rule: &Reached) -> i64 {
    i64::from(rule.radius.0) * i64::from(rule.radius.0)
}

/// Returns e = `position` - `target`, µm; both within ±4 m a coordinate.
pub fn error(position: PerAxis<i32>, target: Point) -> PerAxis<i32> {
    let target = target.micrometres();
    per_axis(|i| position[i] - target[i])
}

/// Returns |e| in whole micrometres, rounded down; e within ±8 m a coordinate, so 24 bits.
pub fn magnitude(e: PerAxis<i32>) -> u32 {
    let squares: u64 = e.iter().map(|c| u64::from(c.unsigned_abs()).pow(2)).sum();
    squares.isqrt() as u32
}

#[cfg(test)]
mod tests {
    use plumb_protocol::units::{Micrometres, Micros};

    use super::*;

    #[test]
    fn outliers_are_passed_over_and_a_true_jump_is_not() {
        let mut tracker = BallTracker::default();
        let (home, away) = ([0, 0, -500_000], [0, 50_000, -500_000]);
        for ball in [home, home, away, home, away, away, home] {
            tracker.update(Micros(0), ball);
            assert_eq!(tracker.filtered(), Some(home));
        }
        for _ in 0..30 {
            tracker.update(Micros(0), away);
        }
        assert!(tracker.filtered().is_some_and(|p| (p[1] - away[1]).abs() < 100));
    }

    /// Takes in e of a position. Returns whether the target counts as reached now.
    fn update(arrival: &mut ArrivalDetector, e: PerAxis<i32>, rule: &Reached) -> bool {
        arrival.observe(e, rule);
        arrival.has_arrived(rule)
    }

    /// Returns the number of positions after which a ball at `x` (µm, of the number; the target is
    /// at 0) has reached its target within 10 mm; at most 300. It comes from 100 mm away in ten
    /// positions before that.
    fn reached_after(x: impl Fn(i32) -> i32) -> Option<i32> {
        let rule = Reached { radius: Micrometres(10_000), frames: 4 };
        let mut arrival = ArrivalDetector::default();
        let way = |k: i32| x(k) - (10_000 * k).min(0);
        (-10..300).find(|k| update(&mut arrival, [way(*k), 0, 0], &rule))
    }

    /// Returns a swing of `amplitude` (µm) at `hz`, with 30 positions/s.
    fn swing(amplitude: i32, hz: f64) -> impl Fn(i32) -> i32 {
        move |k| {
            (f64::from(amplitude) * libm::sin(core::f64::consts::TAU * hz * f64::from(k) / 30.0))
                as i32
        }
    }

    #[test]
    fn a_ball_at_rest_has_reached_its_target_in_a_few_positions() {
        assert!(reached_after(|_| 0).is_some_and(|k| (5..16).contains(&k)));
        assert!(reached_after(|_| 6_000).is_some_and(|k| (5..20).contains(&k)));
        assert_eq!(reached_after(|_| 9_500), None);
    }

    #[test]
    fn a_ball_that_swings_about_its_target_has_not_reached_it() {
        for hz in [0.9, 1.4, 2.0, 3.0, 3.75] {
            assert_eq!(reached_after(swing(15_000, hz)), None, "{hz} Hz");
            assert!(reached_after(swing(2_000, hz)).is_some_and(|k| k < 20), "{hz} Hz");
            let dying = |k: i32| swing((100_000 - 1_000 * k).max(0), hz)(k);
            assert!(reached_after(dying).is_some_and(|k| k > 85), "{hz} Hz");
        }
    }

    /// A ball that turns back has no velocity for a moment. Its picture is two positions old when
    /// the board reports.
    #[test]
    fn a_ball_that_turns_back_is_still_near_when_it_counts_as_arrived() {
        let rule = Reached { radius: Micrometres(10_000), frames: 4 };
        for (nearest, bend) in [(0, 250), (3_000, 200), (5_500, 300), (6_500, 250), (7_500, 200)] {
            let way = |k: i32| nearest + bend * k * k;
            let mut arrival = ArrivalDetector::default();
            let reached = (-20..20).find(|k| update(&mut arrival, [way(*k), 0, 0], &rule));
            assert!(reached.is_none_or(|k| way(k + 2) <= 10_000), "{nearest} µm, {bend}");
        }
    }

    #[test]
    fn a_ball_that_passes_its_target_has_not_reached_it() {
        let rule = Reached { radius: Micrometres(10_000), frames: 4 };
        for speed in [2_000, 3_000, 10_000] {
            let mut arrival = ArrivalDetector::default();
            for k in -30..30 {
                assert!(
                    !update(&mut arrival, [0, 0, speed * k], &rule),
                    "{speed} µm a position: {k}"
                );
            }
        }
    }

    #[test]
    fn white_noise_takes_more_positions() {
        let noise = |size: i32| move |k: i32| if k % 2 == 0 { size } else { -size };
        let (little, much) = (reached_after(noise(1_000)), reached_after(noise(6_000)));
        let (little, much) = (little.unwrap_or(i32::MAX), much.unwrap_or(i32::MAX));
        assert!(little < 16 && (little + 1..40).contains(&much), "{little} {much}");
    }

    /// Positions at both ends of the widest workspace overflow nothing.
    #[test]
    fn jumps_through_the_widest_workspace_are_far_from_any_target() {
        let rule = Reached { radius: Micrometres(1_000_000), frames: 1 };
        let mut arrival = ArrivalDetector::default();
        for k in 0..1000 {
            let e = if k % 7 < 3 { 8_000_000 } else { -8_000_000 };
            assert!(!update(&mut arrival, [e, -e, e], &rule), "{k}");
        }
    }
}
