//! A device's time stamps on the host's clock.

use std::collections::VecDeque;

/// Pictures that the least delay is looked for in: 10 s at 30 Hz. Two clocks drift by 1 ms in that
/// time at most.
const WINDOW: usize = 300;

/// A jump of the device's clock against the host's by so much is a new beginning, seconds.
const JUMP: f64 = 1.0;

/// Maps a device's time stamps to the host's clock.
///
/// Of arrival and time stamp, both of one picture, only the time stamp is regular: the arrival is
/// late by a transfer and by whatever the host was busy with. The picture that was least late of
/// the last 300 tells how the clocks stand to each other, and that one is taken to be `latency`
/// late: the time from exposure to the earliest arrival, which no time stamp can tell.
#[derive(Debug, Clone)]
pub struct HostClock {
    latency: f64,
    /// Arrival less time stamp of the last pictures, seconds.
    offsets: VecDeque<f64>,
}

impl HostClock {
    /// For a camera whose pictures arrive `latency` seconds after they were taken at the earliest.
    pub fn new(latency: f64) -> Self {
        Self { latency, offsets: VecDeque::with_capacity(WINDOW) }
    }

    /// When the picture was taken, seconds on the host's clock, that the device has stamped with
    /// `stamp` seconds of its own and that arrived at `arrival`, seconds on the host's. Never after
    /// its arrival.
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
    fn a_device_clock_that_begins_anew_is_followed_at_once() {
        let mut clock = HostClock::new(0.0);
        assert_eq!(clock.taken(1000.0, 5.0), 5.0);
        assert_eq!(clock.taken(1001.0, 6.0), 6.0);
        assert_eq!(clock.taken(0.0, 7.0), 7.0);
        assert_eq!(clock.taken(0.5, 7.6), 7.5);
    }
}
