//! Mapping of a device's time stamps to the host's clock.

use std::collections::VecDeque;

/// Pictures among which the least delayed one is searched: 10 s at 30 Hz. Two clocks drift by at
/// most 1 ms in that time.
const WINDOW: usize = 300;

/// Jump of the device's clock against the host's that restarts the mapping, seconds.
const JUMP: f64 = 1.0;

/// Mapping of a device's time stamps to the host's clock.
///
/// Time stamps are regular; arrivals are delayed by the transfer and by the load of the host. The
/// offset between the clocks is that of the least delayed picture among the last 300, less
/// `latency`: the time from exposure to the earliest arrival, which no time stamp contains.
#[derive(Debug, Clone)]
pub struct HostClock {
    latency: f64,
    /// Arrival minus time stamp of the last pictures, seconds.
    offsets: VecDeque<f64>,
}

impl HostClock {
    /// Maps the time stamps of a camera whose pictures arrive at the earliest `latency` seconds
    /// after their exposure.
    pub fn new(latency: f64) -> Self {
        Self { latency, offsets: VecDeque::with_capacity(WINDOW) }
    }

    /// Returns the time of a picture's exposure, seconds on the host's clock, never after its
    /// arrival. `stamp` is the device's time stamp, `arrival` the arrival on the host's clock,
    /// both in seconds.
    pub fn taken(&mut self, stamp: f64, arrival: f64) -> f64 {
        let offset = arrival - stamp;
        let least = |offsets: &VecDeque<f64>| offsets.iter().copied().fold(f64::INFINITY, f64::min);
        if (offset - least(&self.offsets)).abs() > JUMP {
            self.offsets.clear();
        }
        if self.offsets.len() == WINDOW {
            self.offsets.pop_front();
        }
        self.offsets.push_back(offset);
        (stamp + least(&self.offsets)).min(arrival) - self.latency
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

    #[test]
    fn a_restarted_device_clock_is_followed_at_once() {
        let mut clock = HostClock::new(0.0);
        assert_eq!(clock.taken(1000.0, 5.0), 5.0);
        assert_eq!(clock.taken(1001.0, 6.0), 6.0);
        assert_eq!(clock.taken(0.0, 7.0), 7.0);
        assert_eq!(clock.taken(0.5, 7.6), 7.5);
    }
}
