//! Clocks of live sources and of devices, and the mapping of time stamps of devices and programs to
//! the host's clock.

use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use thiserror::Error;

use crate::pairing::Sensor;

/// Largest rate at which the two clocks drift apart, seconds a second. Crystals stay below 2e-4. A
/// program that counts 30 pictures a second where a camera takes 29.97 is off by 1e-3.
const DRIFT: f64 = 1e-3;

/// Mapping of a device's time stamps to the host's clock.
///
/// Time stamps are regular; arrivals are delayed by the transfer and by the load of the host. The
/// offset between the clocks is that of the fastest picture, less `latency`: its time from
/// exposure to arrival, which no time stamp contains. It may grow by 1 ms a second,
/// because clocks drift apart. So a delay that lasts stays visible as age: one of 0.5 s is still
/// 0.44 s after a minute.
#[derive(Debug, Clone)]
pub struct HostClock {
    latency: f64,
    last: Option<Last>,
}

/// State after the last picture.
#[derive(Debug, Clone, Copy)]
struct Last {
    /// Time stamp, seconds on the device's clock.
    stamp: f64,
    /// Offset (arrival minus time stamp) of the fastest picture, seconds.
    least: f64,
}

impl HostClock {
    /// Maps the time stamps of a camera whose pictures arrive at the earliest `latency` seconds
    /// after their exposure.
    pub fn new(latency: f64) -> Self {
        Self { latency, last: None }
    }

    /// Returns the time of a picture's exposure, seconds on the host's clock, never after its
    /// arrival. `stamp` is the device's time stamp, `arrival` the arrival on the host's clock,
    /// both in seconds.
    ///
    /// The mapping starts again where the device's clock was set back: where a time stamp is before
    /// the last one. A clock that was set ahead makes the picture the fastest one.
    pub fn taken(&mut self, stamp: f64, arrival: f64) -> f64 {
        let offset = arrival - stamp;
        let least = match self.last.filter(|last| stamp >= last.stamp) {
            Some(last) => offset.min(last.least + DRIFT * (stamp - last.stamp)),
            None => offset,
        };
        self.last = Some(Last { stamp, least });
        // The sum may be rounded up.
        (stamp + least).min(arrival) - self.latency
    }
}

/// Mappings of the time stamps of a camera's two sensors. Each sensor has its own, so that the late
/// pictures of one do not change those of the other.
#[derive(Debug, Clone)]
pub struct SensorClocks([HostClock; 2]);

impl SensorClocks {
    /// Maps the time stamps of sensors as [`HostClock::new`].
    pub fn new(latency: f64) -> Self {
        Self([HostClock::new(latency), HostClock::new(latency)])
    }

    /// Returns the time of exposure of a picture of `sensor`, as [`HostClock::taken`].
    pub fn taken(&mut self, sensor: Sensor, stamp: f64, arrival: f64) -> f64 {
        self.0[sensor.index()].taken(stamp, arrival)
    }
}

/// Clock of a live source: seconds since its start, in real time; 0 before. Clones show the same
/// time in every thread.
#[derive(Debug, Clone, Default)]
pub struct LiveClock(Arc<OnceLock<Instant>>);

impl LiveClock {
    /// Returns a clock that started at `start`.
    pub fn since(start: Instant) -> Self {
        Self(Arc::new(OnceLock::from(start)))
    }

    /// Starts the clock if it stands. Returns the time of its start.
    pub fn start(&self) -> Instant {
        *self.0.get_or_init(Instant::now)
    }

    /// Returns the seconds since the start; 0 before it.
    pub fn now(&self) -> f64 {
        self.0.get().map_or(0.0, |start| start.elapsed().as_secs_f64())
    }
}

/// Clock that stamps the frames of a device or of a device's recording.
#[derive(Debug, Clone)]
pub enum DeviceClock {
    /// The host's, since the device was opened.
    Host(LiveClock),
    /// The recording's: time stamp of its last frame, seconds.
    Recording(f64),
}

impl DeviceClock {
    /// Returns the clock of a device that was opened at `start`.
    pub fn since(start: Instant) -> Self {
        Self::Host(LiveClock::since(start))
    }

    /// Returns the clock of a recording, which begins at 0.
    pub fn recording() -> Self {
        Self::Recording(0.0)
    }

    /// Sets the clock of a recording to the time stamp of a frame, seconds.
    pub fn follow(&mut self, stamp: f64) {
        if let Self::Recording(now) = self {
            *now = stamp;
        }
    }

    /// Returns the present time, seconds.
    pub fn now(&self) -> f64 {
        match self {
            Self::Host(clock) => clock.now(),
            Self::Recording(now) => *now,
        }
    }

    /// Returns the clock of a live device; `None` for a recording.
    pub fn live(&self) -> Option<&LiveClock> {
        match self {
            Self::Host(clock) => Some(clock),
            Self::Recording(_) => None,
        }
    }
}

/// Change of the offset between a sender's clock and the host's from one frame to the next above
/// which the time of the frame is unknown, seconds.
const MAX_JUMP_S: f64 = 1.0;

/// Reason why the time of a frame is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum SenderClockError {
    /// A time stamp is not after the one before.
    #[error("the time stamp {t} s is not after the one before, {before} s")]
    NotGrowing {
        /// Time stamp, seconds.
        t: f64,
        /// Time stamp of the frame before, seconds.
        before: f64,
    },
    /// The time stamps and the arrivals do not run evenly.
    #[error(
        "the time stamp has moved by {0:+.3} s against this computer's clock since the one before: \
         {cause}",
        cause = Self::cause_of(*.0)
    )]
    Jump(f64),
    /// The time stamps run slower than the host's clock, so that the frames seem to grow old.
    #[error(
        "the time stamps run at {0:.3} times the rate of this computer's clock: stamp each frame \
         with its time (a count of frames at a nominal rate is none), or send without a backlog"
    )]
    Rate(f64),
}

impl SenderClockError {
    /// Returns the likely causes of a jump of the time stamps against the host's clock, seconds.
    fn cause_of(jump: f64) -> &'static str {
        if jump > 0.0 {
            "the sender's clock was set, or `t` is not in seconds"
        } else {
            "the sender's clock was set, or its data was held up"
        }
    }
}

/// Mapping of the time stamps of one sender to the host's clock.
#[derive(Debug)]
pub struct SenderClock {
    mapping: HostClock,
    before: Option<Before>,
    delays: Delays,
}

/// The frame before.
#[derive(Debug, Clone, Copy)]
struct Before {
    /// Time stamp, seconds on the sender's clock.
    t: f64,
    /// Arrival on the host's clock minus sending on the sender's clock, seconds.
    offset: f64,
}

impl Default for SenderClock {
    fn default() -> Self {
        Self::new()
    }
}

impl SenderClock {
    /// Returns the mapping of a new sender.
    pub fn new() -> Self {
        // The sender states the age of its frames, where it knows it.
        Self { mapping: HostClock::new(0.0), before: None, delays: Delays::default() }
    }

    /// Returns the time of a frame's exposure, seconds on the host's clock. The exposure was at
    /// `t` on the sender's clock, the frame was `age` seconds old when it was sent, and it arrived
    /// at `arrival` on the host's clock.
    ///
    /// # Errors
    /// Where the time is unknown: `t` does not grow, the clocks have moved against each other, or
    /// they run at different rates.
    pub fn taken(&mut self, t: f64, age: f64, arrival: f64) -> Result<f64, SenderClockError> {
        let offset = arrival - age - t;
        if let Some(before) = self.before.replace(Before { t, offset }) {
            let jump = before.offset - offset;
            if t <= before.t || jump.abs() > MAX_JUMP_S {
                self.delays = Delays::default();
            }
            if t <= before.t {
                return Err(SenderClockError::NotGrowing { t, before: before.t });
            }
            if jump.abs() > MAX_JUMP_S {
                return Err(SenderClockError::Jump(jump));
            }
        }
        let taken = self.mapping.taken(t, arrival - age);
        self.delays.add(arrival, offset);
        match self.delays.rate() {
            Some(rate) if arrival - age - taken > LAG_S => Err(SenderClockError::Rate(rate)),
            _ => Ok(taken),
        }
    }
}

/// Time in which the fastest frame counts, seconds, and the number of such times that are kept: 8 s
/// at 30 frames a second.
const WINDOW_S: f64 = 0.1;
const MAX_WINDOWS: usize = 80;

/// Number of such times after which a rate is known.
const MIN_WINDOWS: usize = 5;

/// Age of a frame above which its delay is looked at, seconds: below the age that boards refuse.
const LAG_S: f64 = 0.2;

/// Least growth of the delay in that time that is a rate, seconds: 1 % of it.
const MIN_GROWTH_S: f64 = 0.08;

/// Delays of the fastest frames of the last seconds, oldest first.
#[derive(Debug, Default)]
struct Delays(VecDeque<Delay>);

#[derive(Debug, Clone, Copy)]
struct Delay {
    /// Arrival of the first frame, seconds on the host's clock.
    begin: f64,
    /// Least arrival minus time stamp, seconds.
    least: f64,
}

impl Delays {
    fn add(&mut self, arrival: f64, delay: f64) {
        match self.0.back_mut() {
            Some(last) if arrival - last.begin < WINDOW_S => last.least = last.least.min(delay),
            _ => self.0.push_back(Delay { begin: arrival, least: delay }),
        }
        if self.0.len() > MAX_WINDOWS {
            self.0.pop_front();
        }
    }

    /// Returns the rate of the time stamps against the host's clock where they lag behind it, and
    /// do so in both halves of the time: a frame that was held up has its delay in one of them.
    fn rate(&self) -> Option<f64> {
        let (first, last) = (self.0.front()?, self.0.back()?);
        let (lag, half) = (last.least - first.least, self.0[self.0.len() / 2].least - first.least);
        let is_steady = (0.3..=0.7).contains(&(half / lag));
        let is_known = self.0.len() >= MIN_WINDOWS && lag > MIN_GROWTH_S && is_steady;
        is_known.then(|| 1.0 - lag / (last.begin - first.begin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_arrivals_do_not_move_the_picture() {
        let mut clock = HostClock::new(0.02);
        let mut worst: f64 = 0.0;
        for frame in 0..2000_u32 {
            // The device's clock is 500 s ahead and runs 50 ppm fast; every seventh picture is on
            // time.
            let taken = f64::from(frame) / 30.0;
            let late = if frame % 7 == 0 { 0.0 } else { f64::from(frame % 5) * 0.01 };
            let mapped = clock.taken(500.0 + taken * 1.000_05, taken + 0.02 + late);
            if frame >= 7 {
                worst = worst.max((mapped - taken).abs());
            }
            assert!(mapped <= taken + late, "frame {frame}: {mapped} for {taken}");
        }
        assert!(worst < 0.001, "{worst}");
    }

    /// Returns the age of the last of `frames` pictures on arrival, each `delay(number)` late.
    fn age_at_the_end(frames: u32, delay: impl Fn(u32) -> f64) -> f64 {
        let mut clock = HostClock::new(0.0);
        let mut age = 0.0;
        for frame in 0..frames {
            let taken = f64::from(frame) / 30.0;
            let arrival = taken + delay(frame);
            age = arrival - clock.taken(500.0 + taken, arrival);
        }
        age
    }

    #[test]
    fn a_backlog_that_grows_is_age() {
        // 10 ms more with each picture.
        let age = age_at_the_end(300, |frame| 0.01 * f64::from(frame));
        assert!((age - 2.99).abs() < 0.02, "{age}");
    }

    #[test]
    fn a_delay_that_lasts_is_age() {
        let age = age_at_the_end(1800, |frame| if frame < 30 { 0.0 } else { 0.5 });
        assert!((0.43..=0.5).contains(&age), "{age}");
    }

    #[test]
    fn pictures_that_were_held_up_are_old() {
        // The host stands still for 3 s and then reads 90 pictures at once.
        let held = |frame: u32| if frame < 100 { 0.0 } else { f64::from(190 - frame) / 30.0 };
        let age = age_at_the_end(101, held);
        assert!((age - 3.0).abs() < 0.01, "{age}");
        let age = age_at_the_end(191, held);
        assert!(age < 0.01, "{age}");
    }

    #[test]
    fn a_delay_that_shrinks_is_still_age() {
        // The host stands still twice: for 3 s, and until the next picture is 1.6 s old.
        let twice = |frame: u32| [0.0, 3.0, 1.6, 1.6][frame.saturating_sub(99).min(3) as usize];
        for (frames, expected) in [(101, 3.0), (102, 1.6), (300, 1.6)] {
            let age = age_at_the_end(frames, twice);
            assert!((age - expected).abs() < 0.01, "{age} after {frames}");
        }
    }

    #[test]
    fn a_device_clock_that_was_set_is_followed_at_once() {
        let mut clock = HostClock::new(0.0);
        assert_eq!(clock.taken(1000.0, 5.0), 5.0);
        assert!((clock.taken(1001.0, 6.0) - 6.0).abs() < 1e-9);
        // Back to zero, then far ahead.
        assert_eq!(clock.taken(0.0, 7.0), 7.0);
        assert!((clock.taken(0.5, 7.6) - 7.5).abs() < 0.001);
        assert_eq!(clock.taken(900.0, 7.7), 7.7);
    }

    #[test]
    fn the_stated_age_is_subtracted_and_delays_are_not_added() {
        let mut clock = SenderClock::new();
        // The sender's clock is 500 s ahead. Frames are 30 to 50 ms old when they are sent, and
        // take 1 to 9 ms.
        for frame in 0..100 {
            let taken = f64::from(frame) / 60.0;
            let age = 0.03 + f64::from(frame % 3) * 0.01;
            let delay = if frame % 7 == 0 { 0.001 } else { 0.009 };
            let mapped = clock.taken(500.0 + taken, age, taken + age + delay).unwrap();
            assert!((mapped - taken - 0.001).abs() < 2e-4, "frame {frame}: {mapped} for {taken}");
        }
    }

    #[test]
    fn a_frame_whose_time_is_unknown_is_lost() {
        let mut clock = SenderClock::new();
        clock.taken(10.0, 0.0, 1.0).unwrap();
        let again = clock.taken(10.0, 0.0, 1.1).unwrap_err();
        assert!(matches!(again, SenderClockError::NotGrowing { .. }), "{again}");
        clock.taken(10.2, 0.0, 1.2).unwrap();
        // Held up for 3 s, then in time again.
        let late = clock.taken(10.3, 0.0, 4.3).unwrap_err();
        assert!(matches!(late, SenderClockError::Jump(jump) if jump < -2.9), "{late}");
        assert!(clock.taken(13.4, 0.0, 4.4).is_err());
        assert!((clock.taken(13.5, 0.0, 4.5).unwrap() - 4.5).abs() < 1e-9);
        // A clock that was set is followed after one frame.
        assert!(clock.taken(1000.0, 0.0, 4.6).is_err());
        assert!((clock.taken(1000.1, 0.0, 4.7).unwrap() - 4.7).abs() < 1e-9);
    }

    /// Returns the rate at which time stamps that are counted at `nominal` frames a second are
    /// refused where so many `sent` a second come, and the seconds until then.
    fn refused_rate(nominal: f64, sent: f64) -> Option<(f64, f64)> {
        let mut clock = SenderClock::new();
        (0..1000).map(f64::from).find_map(|n| {
            let arrival = n / sent + 0.01 * (7.0 * n).sin().abs();
            match clock.taken(500.0 + n / nominal, 0.03, arrival) {
                Err(SenderClockError::Rate(rate)) => Some((rate, arrival)),
                other => {
                    assert!(other.is_ok(), "{other:?}");
                    None
                }
            }
        })
    }

    #[test]
    fn time_stamps_of_a_counter_are_refused_with_their_rate_before_a_board_refuses_their_age() {
        for (nominal, sent) in [(30.0, 29.0), (30.0, 29.5), (30.0, 25.0), (30.0, 15.0), (2.0, 1.9)]
        {
            let (rate, after) = refused_rate(nominal, sent).unwrap();
            assert!((rate - sent / nominal).abs() < 0.02, "{sent}: {rate}");
            assert!(after * (1.0 - sent / nominal) < 0.3, "{sent}: {after} s");
        }
        for sent in [29.97, 30.0, 31.0, 60.0] {
            assert_eq!(refused_rate(30.0, sent), None, "{sent}");
        }
    }

    #[test]
    fn frames_after_one_that_was_held_up_keep_their_age() {
        let mut clock = SenderClock::new();
        // A link with a backlog: one delay falls by more than a second.
        let delays = [0.0, 0.9, 1.8, 2.7, 1.5, 1.4, 1.3];
        for (frame, delay) in (0..).zip(delays) {
            let sent = f64::from(frame) * 2.0;
            match clock.taken(500.0 + sent, 0.0, sent + delay) {
                Ok(taken) => assert!((taken - sent).abs() < 0.02, "frame {frame}: {taken}"),
                Err(error) => assert!(frame == 4, "frame {frame}: {error}"),
            }
        }
    }
}
