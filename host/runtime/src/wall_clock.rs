//! Wall clock of the messages that leave a run.

use std::time::{SystemTime, UNIX_EPOCH};

use plumb_frame::clock::LiveClock;

/// Number of attempts to read two clocks at one moment.
const ATTEMPTS: usize = 5;

/// Clock of messages: the run's time, mapped to the wall clock. The mapping is made once, from two
/// clocks that are read at one moment, so that a wall clock that is set during the run tears no
/// gap.
#[derive(Debug, Default)]
pub struct RunClock {
    /// Clock that stamps the frames; `None` where it is not known, or stands.
    frames: Option<LiveClock>,
    /// Wall clock at the run's start, nanoseconds since 1970; `None` before the first stamp.
    start: Option<u64>,
}

/// Time stamps of one frame, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameTime {
    /// Since the run's start.
    pub run: f64,
    /// On the clock that stamps the frames; `None` where the frame is not at hand.
    pub clock: Option<f64>,
}

/// Two clocks at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Readings {
    /// Clock that stamps the frames, seconds; `None` where there is none.
    clock: Option<f64>,
    /// Wall clock, nanoseconds since 1970.
    wall: u64,
}

impl RunClock {
    /// Sets the clock that stamps the frames. Without it the first frame counts as taken when it is
    /// stamped here.
    pub fn set_frames_clock(&mut self, clock: LiveClock) {
        self.frames = Some(clock);
    }

    /// Returns the stamp of `time`, seconds since the run's start, in nanoseconds since 1970. The
    /// first stamp sets the run's start: `time` is then now.
    pub fn stamp(&mut self, time: f64) -> u64 {
        self.stamp_frame(FrameTime { run: time, clock: None })
    }

    /// Returns the wall clock at the exposure of a frame, nanoseconds since 1970. The first stamp
    /// sets the run's start: from the age of the frame where its clock is known, else as
    /// [`Self::stamp`].
    pub fn stamp_frame(&mut self, frame: FrameTime) -> u64 {
        self.stamp_with(frame, Readings::take)
    }

    /// Does the same with a function that reads the clocks. It is called for the first stamp only.
    fn stamp_with(
        &mut self,
        frame: FrameTime,
        read: impl FnOnce(Option<&LiveClock>) -> Readings,
    ) -> u64 {
        let start = *self.start.get_or_insert_with(|| {
            let now = read(self.frames.as_ref());
            let age = now.clock.zip(frame.clock).map_or(0.0, |(now, taken)| now - taken);
            now.wall.saturating_sub(nanoseconds(age)).saturating_sub(nanoseconds(frame.run))
        });
        start.saturating_add(nanoseconds(frame.run))
    }
}

impl Readings {
    /// Reads the clocks. Where the thread is interrupted in between, another attempt is better.
    fn take(clock: Option<&LiveClock>) -> Self {
        let Some(clock) = clock else { return Self { clock: None, wall: now() } };
        let attempts = (0..ATTEMPTS).map(|_| {
            let (before, wall) = (clock.now(), now());
            (clock.now() - before, Self { clock: Some(before), wall })
        });
        let best = attempts.min_by(|(one, _), (other, _)| one.total_cmp(other));
        best.map_or_else(|| Self::take(None), |(_, readings)| readings)
    }
}

/// Returns the wall clock, nanoseconds since 1970.
pub fn now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
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
    fn stamps_differ_as_the_times_of_the_run_do() {
        let mut clock = RunClock::default();
        let before = now();
        let first = clock.stamp(2.5);
        assert!((before..=now()).contains(&first), "{first}");
        assert_eq!(clock.stamp(2.533_333) - first, 33_333_000);
        assert_eq!(first - clock.stamp(0.0), 2_500_000_000);
    }

    #[test]
    fn a_stamp_is_the_wall_clock_at_the_exposure() {
        let mut clock = RunClock::default();
        // The first frame is taken at 10 s, and comes here 350 ms later, after a slow search. The
        // others come after 60 ms.
        for (k, age) in [(0, 0.35), (1, 0.06), (2, 0.06)] {
            let run = f64::from(k) / 30.0;
            let taken = 10.0 + run;
            let frame = FrameTime { run, clock: Some(taken) };
            let stamp = clock.stamp_with(frame, |_| at(taken + age));
            assert!(stamp.abs_diff(ZERO + nanoseconds(taken)) < 10, "{k}: {stamp}");
        }
    }

    #[test]
    fn a_wall_clock_that_is_set_later_moves_no_stamp() {
        let mut clock = RunClock::default();
        let first = FrameTime { run: 0.0, clock: Some(10.0) };
        let first = clock.stamp_with(first, |_| at(10.1));
        let set = Readings { wall: ZERO + 3_600_000_000_000, ..at(10.133) };
        let second = FrameTime { run: 0.033, clock: Some(10.033) };
        let second = clock.stamp_with(second, |_| set);
        assert_eq!(second - first, 33_000_000);
    }

    #[test]
    fn a_clock_that_runs_is_read_with_the_wall_clock() {
        let mut clock = RunClock::default();
        let begin = Instant::now();
        let zero = now();
        clock.set_frames_clock(LiveClock::since(begin - Duration::from_secs(100)));
        // The frame was taken 60 s before the test.
        let stamp = clock.stamp_frame(FrameTime { run: 0.0, clock: Some(40.0) });
        assert!(stamp.abs_diff(zero - 60_000_000_000) < 1_000_000_000, "{stamp} for {zero}");
    }

    #[test]
    fn without_a_clock_the_first_frame_is_taken_when_it_comes() {
        let mut clock = RunClock::default();
        let now = Readings { clock: None, wall: ZERO };
        let first = FrameTime { run: 0.5, clock: Some(7.0) };
        assert_eq!(clock.stamp_with(first, |_| now), ZERO);
        let next = FrameTime { run: 0.75, clock: Some(7.25) };
        assert_eq!(clock.stamp_with(next, |_| now), ZERO + 250_000_000);
    }
}
