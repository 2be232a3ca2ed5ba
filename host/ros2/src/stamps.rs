//! Stamps of the messages about frames.

use plumb_cameras::source::LiveClock;
use plumb_runtime::wall_clock;

/// Number of attempts to read two clocks at one moment.
const ATTEMPTS: usize = 5;

/// Mapping of the run's time to the wall clock. It is made once, from two clocks that are read at
/// one moment, so that a wall clock that is set during the run tears no gap.
#[derive(Debug, Default)]
pub(crate) struct Stamps {
    /// Clock that stamps the frames; `None` where it is not known, or stands.
    clock: Option<LiveClock>,
    /// Wall clock at the run's start, nanoseconds since 1970; `None` before the first frame.
    start: Option<u64>,
}

/// Time stamps of one frame, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameTime {
    /// Since the run's start.
    pub(crate) run: f64,
    /// On the clock that stamps the frames; `None` where the frame is not at hand.
    pub(crate) clock: Option<f64>,
}

/// Two clocks at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Readings {
    /// Clock that stamps the frames, seconds; `None` where there is none.
    clock: Option<f64>,
    /// Wall clock, nanoseconds since 1970.
    wall: u64,
}

impl Stamps {
    /// Sets the clock that stamps the frames. Without it the first frame counts as taken when it
    /// comes here.
    pub(crate) fn set_clock(&mut self, clock: LiveClock) {
        self.clock = Some(clock);
    }

    /// Returns the wall clock at the exposure of a frame, nanoseconds since 1970.
    pub(crate) fn stamp(&mut self, frame: FrameTime) -> u64 {
        self.stamp_with(frame, Readings::take)
    }

    /// Does the same with a function that reads the clocks. It is called for the first frame only.
    fn stamp_with(
        &mut self,
        frame: FrameTime,
        read: impl FnOnce(Option<&LiveClock>) -> Readings,
    ) -> u64 {
        let start = *self.start.get_or_insert_with(|| {
            let now = read(self.clock.as_ref());
            let age = now.clock.zip(frame.clock).map_or(0.0, |(now, taken)| now - taken);
            now.wall.saturating_sub(nanoseconds(age)).saturating_sub(nanoseconds(frame.run))
        });
        start.saturating_add(nanoseconds(frame.run))
    }
}

impl Readings {
    /// Reads the clocks. Where the thread is interrupted in between, another attempt is better.
    fn take(clock: Option<&LiveClock>) -> Self {
        let Some(clock) = clock else { return Self { clock: None, wall: wall_clock::now() } };
        let attempts = (0..ATTEMPTS).map(|_| {
            let (before, wall) = (clock.now(), wall_clock::now());
            (clock.now() - before, Self { clock: Some(before), wall })
        });
        let best = attempts.min_by(|(one, _), (other, _)| one.total_cmp(other));
        best.map_or_else(|| Self::take(None), |(_, readings)| readings)
    }
}

/// Converts seconds. A time before 0 is 0.
fn nanoseconds(seconds: f64) -> u64 {
    (seconds.max(0.0) * 1e9).round() as u64
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    /// Wall clock when the clock of the frames was 0, nanoseconds since 1970.
    const ZERO: u64 = 1_800_000_000_000_000_000;

    /// Returns the readings at `clock` seconds on the clock of the frames.
    fn at(clock: f64) -> Readings {
        Readings { clock: Some(clock), wall: ZERO + nanoseconds(clock) }
    }

    #[test]
    fn a_stamp_is_the_wall_clock_at_the_exposure() {
        let mut stamps = Stamps::default();
        // The first frame is taken at 10 s, and comes here 350 ms later, after a slow search. The
        // others come after 60 ms.
        for (k, age) in [(0, 0.35), (1, 0.06), (2, 0.06)] {
            let run = f64::from(k) / 30.0;
            let taken = 10.0 + run;
            let frame = FrameTime { run, clock: Some(taken) };
            let stamp = stamps.stamp_with(frame, |_| at(taken + age));
            assert!(stamp.abs_diff(ZERO + nanoseconds(taken)) < 10, "{k}: {stamp}");
        }
    }

    #[test]
    fn a_wall_clock_that_is_set_later_moves_no_stamp() {
        let mut stamps = Stamps::default();
        let first = FrameTime { run: 0.0, clock: Some(10.0) };
        let first = stamps.stamp_with(first, |_| at(10.1));
        let set = Readings { wall: ZERO + 3_600_000_000_000, ..at(10.133) };
        let second = FrameTime { run: 0.033, clock: Some(10.033) };
        let second = stamps.stamp_with(second, |_| set);
        assert_eq!(second - first, 33_000_000);
    }

    #[test]
    fn a_clock_that_runs_is_read_with_the_wall_clock() {
        let mut stamps = Stamps::default();
        let begin = Instant::now();
        let zero = wall_clock::now();
        stamps.set_clock(LiveClock::since(begin - Duration::from_secs(100)));
        // The frame was taken 60 s before the test.
        let stamp = stamps.stamp(FrameTime { run: 0.0, clock: Some(40.0) });
        assert!(stamp.abs_diff(zero - 60_000_000_000) < 1_000_000_000, "{stamp} for {zero}");
    }

    #[test]
    fn without_a_clock_the_first_frame_is_taken_when_it_comes() {
        let mut stamps = Stamps::default();
        let now = Readings { clock: None, wall: ZERO };
        let first = FrameTime { run: 0.5, clock: Some(7.0) };
        assert_eq!(stamps.stamp_with(first, |_| now), ZERO);
        let next = FrameTime { run: 0.75, clock: Some(7.25) };
        assert_eq!(stamps.stamp_with(next, |_| now), ZERO + 250_000_000);
    }
}
