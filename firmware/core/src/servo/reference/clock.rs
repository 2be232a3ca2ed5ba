//! The path's time on the board: how far along its path the reference is.

use plumb_protocol::message::Reference;
use plumb_protocol::units::Micros;

use super::path::Path;

/// Time between two states of the reference, µs: 16.4 ms. A power of two spares the chip divisions.
pub(super) const STEP_US: u32 = 1 << STEP_BITS;
/// Its binary logarithm.
pub(super) const STEP_BITS: u32 = 14;
/// The same in seconds.
pub(super) const STEP_S: f32 = STEP_US as f32 * 1e-6;

/// Highest acceleration by a change of the pace, mm/s²: soft cables bear it, and a path that is too
/// fast for the motors does not speed up and stop in turn.
const ACCELERATION: f32 = 250.0;
/// Highest fall of the pace, 1/s.
const FALL: f32 = 2.5;
/// Time before the end of what the host has sent from which on the pace falls, seconds.
const BRAKING_S: f32 = 0.25;
/// Distance of the reference from its path at which a path that waits stands still, mm.
const FAR_MM: f32 = 8.0;
/// Change of the pace over the time by which a path that goes on is late, 1/s.
const CATCH_UP: f32 = 2.0;
/// Largest change of the pace to catch up.
const MAX_CATCH_UP: f32 = 0.2;
/// Lateness beyond which the path's time jumps, µs. The reference goes after it within its limits.
const MAX_LATE_US: i64 = 150_000;
/// Growth of the clocks' difference that is possible, as 1/this: a message may be late, and none is
/// early.
const DRIFT: u64 = 1000;

/// What decides the pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Conditions {
    /// Filtered distance of the ball from the reference, µm; `None` where the ball is not seen.
    pub(super) deviation: Option<u32>,
    /// Deviation at which a path that waits stands still, µm.
    pub(super) limit: u32,
    /// Pace that the motors can keep.
    pub(super) law_pace: f32,
    /// Speed of the path at the host's pace, mm/s.
    pub(super) speed: f32,
    /// Distance of the reference from its path, mm.
    pub(super) distance: f32,
}

/// The path's time, and its speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PathClock {
    /// The path's time at the newest state of the reference, µs.
    time: i64,
    /// Speed of the path's time: 1 is the host's.
    pace: f32,
    waits: bool,
    /// The path's time less the board's, µs, of the message that was least late.
    offset: i64,
    /// When that was set.
    offset_since: Micros,
}

/// Returns the path's time less the board's by a message that arrives at `now`.
fn offset(now: Micros, reference: &Reference) -> i64 {
    // Both count microseconds. Times beyond 2^62 µs wrap, and the path then jumps.
    reference.now.0.wrapping_sub(now.0) as i64
}

impl PathClock {
    /// Creates the clock of a path whose first message arrives at `now`.
    pub(super) fn new(now: Micros, reference: &Reference) -> Self {
        Self {
            time: reference.now.0 as i64,
            pace: 0.0,
            waits: reference.waits,
            offset: offset(now, reference),
            offset_since: now,
        }
    }

    /// Takes in the times of the next message.
    pub(super) fn update(&mut self, now: Micros, reference: &Reference) {
        self.waits = reference.waits;
        let possible = (now.since(self.offset_since) / DRIFT) as i64;
        let late = self.offset.saturating_sub(possible);
        let seen = offset(now, reference);
        if seen >= late || late.saturating_sub(seen) > MAX_LATE_US {
            (self.offset, self.offset_since) = (seen, now);
        }
    }

    /// Returns the path's time, µs.
    pub(super) fn time(&self) -> i64 {
        self.time
    }

    pub(super) fn pace(&self) -> f32 {
        self.pace
    }

    /// Returns the share of its speed at which the reference may close up to its path.
    pub(super) fn closing(&self, conditions: &Conditions) -> f32 {
        if self.waits { conditions.nearness() } else { 1.0 }
    }

    /// Advances by a step that begins at `now`.
    pub(super) fn step(&mut self, now: Micros, path: &Path, conditions: &Conditions) {
        let wanted = if self.waits { conditions.pace() } else { self.live_pace(now) };
        let left = path.end().saturating_sub(self.time).clamp(0, 1 << 30) as f32 * 1e-6;
        let wanted = if path.has_end() { wanted } else { wanted.min(left / BRAKING_S) };
        let before = self.pace;
        let most = ACCELERATION / conditions.speed.max(1.0);
        self.pace += (wanted - self.pace).clamp(-most.min(FALL) * STEP_S, most * STEP_S);
        let passed = 0.5 * (before + self.pace) * STEP_US as f32;
        self.time = self.time.saturating_add(passed as i64);
    }

    /// Returns the pace of a path that goes on. Where it is very late, its time jumps.
    fn live_pace(&mut self, now: Micros) -> f32 {
        let due = (now.0 as i64).wrapping_add(self.offset);
        let late = due.saturating_sub(self.time);
        if late.abs() > MAX_LATE_US {
            (self.time, self.pace) = (due, 1.0);
            return 1.0;
        }
        1.0 + (CATCH_UP * late as f32 * 1e-6).clamp(-MAX_CATCH_UP, MAX_CATCH_UP)
    }
}

impl Conditions {
    /// Returns 1 for a ball near the reference, 0 for one that is too far or not seen.
    fn nearness(&self) -> f32 {
        let Some(deviation) = self.deviation else { return 0.0 };
        (2.0 - 2.0 * deviation as f32 / self.limit as f32).clamp(0.0, 1.0)
    }

    /// Returns the pace of a path that waits.
    fn pace(&self) -> f32 {
        let on_path = (2.0 - 2.0 * self.distance / FAR_MM).clamp(0.0, 1.0);
        self.nearness().min(on_path).min(self.law_pace)
    }
}

#[cfg(test)]
mod tests {
    use plumb_protocol::message::{KNOTS, Knot};
    use plumb_protocol::units::{Point, Speed};

    use super::*;

    /// A ball on a path of 100 mm/s.
    const ON_PATH: Conditions = Conditions {
        deviation: Some(0),
        limit: 20_000,
        law_pace: 1.0,
        speed: 100.0,
        distance: 0.0,
    };

    /// Returns a message at `now` (µs of the path) with knots from 1 s to 3.5 s that move.
    fn reference(now: u64, waits: bool) -> Reference {
        let knot =
            Knot { position: Point::default(), velocity: [Speed(100_000), Speed(0), Speed(0)] };
        let (now, first) = (Micros(now), Micros(1_000_000));
        Reference { sequence: 0, now, waits, first, interval_us: 500_000, knots: [knot; KNOTS] }
    }

    /// Returns a clock that begins at 1 s of the path, at zero of the board.
    fn clock(waits: bool) -> PathClock {
        PathClock::new(Micros(0), &reference(1_000_000, waits))
    }

    fn is_near(found: f32, expected: f32) -> bool {
        (found - expected).abs() < 1e-4
    }

    #[test]
    fn the_least_late_message_counts_as_far_as_clocks_drift() {
        let mut clock = clock(false);
        let mut update = |now: u64, late: u64| {
            clock.update(Micros(now), &reference(1_000_000 + now - late, false));
            clock.offset
        };
        assert_eq!(update(100_000, 50_000), 1_000_000);
        // 200 us of drift are possible.
        assert_eq!(update(200_000, 201), 1_000_000);
        assert_eq!(update(200_000, 200), 999_800);
        assert_eq!(update(200_000, 150_200), 999_800);
        assert_eq!(update(200_000, 150_201), 849_799);
    }

    #[test]
    fn a_path_that_waits_slows_down_for_a_ball_and_a_reference_that_are_away() {
        let away = |deviation| Conditions { deviation, ..ON_PATH };
        for (deviation, expected) in [(Some(10_000), 1.0), (Some(15_000), 0.5), (Some(20_000), 0.0)]
        {
            assert_eq!(clock(true).closing(&away(deviation)), expected);
            assert_eq!(away(deviation).pace(), expected);
        }
        assert_eq!(clock(true).closing(&away(None)), 0.0);
        assert_eq!(clock(false).closing(&away(None)), 1.0);
        assert_eq!(Conditions { distance: 6.0, ..ON_PATH }.pace(), 0.5);
        assert_eq!(Conditions { law_pace: 0.25, ..ON_PATH }.pace(), 0.25);
    }

    #[test]
    fn the_pace_changes_by_250_mm_a_second_squared_and_falls_by_two_and_a_half_a_second() {
        let path = Path::new(&reference(1_000_000, true));
        let mut clock = clock(true);
        clock.step(Micros(0), &path, &ON_PATH);
        assert!(is_near(clock.pace(), 2.5 * STEP_S), "{clock:?}");
        (0..100).for_each(|_| clock.step(Micros(0), &path, &ON_PATH));
        assert_eq!(clock.pace(), 1.0);
        let slow = Conditions { deviation: None, speed: 10.0, ..ON_PATH };
        clock.step(Micros(0), &path, &slow);
        assert!(is_near(clock.pace(), 1.0 - 2.5 * STEP_S), "{clock:?}");
        let fast = Conditions { deviation: None, speed: 500.0, ..ON_PATH };
        clock.step(Micros(0), &path, &fast);
        assert!(is_near(clock.pace(), 1.0 - 3.0 * STEP_S), "{clock:?}");
    }

    #[test]
    fn a_path_whose_messages_cease_comes_to_rest_at_its_last_knot() {
        let path = Path::new(&reference(1_000_000, true));
        let mut clock = clock(true);
        (0..1000).for_each(|_| clock.step(Micros(0), &path, &ON_PATH));
        assert!((3_480_000..=path.end()).contains(&clock.time()), "{clock:?}");
        assert!(clock.pace() < 0.05, "{clock:?}");
    }

    #[test]
    fn a_path_that_goes_on_catches_up_and_jumps_where_it_is_very_late() {
        for (late_ms, pace) in [(0, 1.0), (50, 1.1), (150, 1.2), (-50, 0.9), (-150, 0.8)] {
            let mut clock = clock(false);
            clock.time -= late_ms * 1000;
            let (time, found) = (clock.time(), clock.live_pace(Micros(0)));
            assert!(is_near(found, pace), "{late_ms} ms: {found}");
            assert_eq!(clock.time(), time);
        }
        for late_us in [150_001, -150_001] {
            let mut clock = clock(false);
            clock.time -= late_us;
            assert_eq!(clock.live_pace(Micros(0)), 1.0);
            assert_eq!(clock.time(), 1_000_000);
        }
    }
}
