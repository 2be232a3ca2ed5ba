//! Mapping of a device's time stamps to the host's clock.

use crate::sensor::Sensor;

/// Largest rate at which the two clocks drift apart, seconds a second. Crystals stay below 2e-4. A
/// program that counts 30 pictures a second where a camera takes 29.97 is off by 1e-3.
const DRIFT: f64 = 1e-3;

/// Mapping of a device's time stamps to the host's clock.
///
/// Time stamps are regular; arrivals are delayed by the transfer and by the load of the host. The
/// offset between the clocks is that of the least delayed picture, less `latency`: the time from
/// exposure to the earliest arrival, which no time stamp contains. It may grow by 1 ms a second,
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
    /// Offset (arrival minus time stamp) of the least delayed picture, seconds.
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
    /// the last one. A clock that was set ahead makes the picture the least delayed one.
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
}
