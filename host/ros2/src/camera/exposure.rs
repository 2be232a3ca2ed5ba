//! Times of exposure of the pictures, on the host's clock.

use std::time::Instant;

use plumb_frame::clock::{SenderClock, SenderClockError};

/// Mapping of the stamps of a camera's node to the host's clock.
#[derive(Debug)]
pub(super) struct ExposureClock {
    sender: SenderClock,
    /// Time from exposure to the earliest arrival of a picture, seconds.
    latency: f64,
    /// Zero of the host's clock.
    zero: Instant,
}

impl ExposureClock {
    /// Maps the stamps of pictures that arrive at the earliest `latency` seconds after their
    /// exposure to a clock that was 0 at `zero`.
    pub(super) fn new(latency: f64, zero: Instant) -> Self {
        Self { sender: SenderClock::new(), latency, zero }
    }

    /// Returns the time of exposure of the picture that has this `stamp` and this `arrival`,
    /// seconds since the zero.
    ///
    /// # Errors
    /// Where the time is unknown, as [`SenderClock::taken`] says.
    pub(super) fn taken(&mut self, stamp: f64, arrival: Instant) -> Result<f64, SenderClockError> {
        let arrival = arrival.saturating_duration_since(self.zero).as_secs_f64();
        self.sender.taken(stamp, self.latency, arrival)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::camera::pairs::{Pairs, Stamped};

    #[test]
    fn depth_that_is_always_late_does_not_move_the_exposure() {
        let zero = Instant::now();
        let (mut pairs, mut clock) = (Pairs::default(), ExposureClock::new(0.02, zero));
        for k in 0..300_u32 {
            // The sender's clock is 500 s ahead. Colour comes 20 ms after the exposure, depth
            // 100 ms after colour.
            let exposed = 1.0 + f64::from(k) / 30.0;
            let stamp = 500.0 + exposed;
            let at = |seconds| zero + Duration::from_secs_f64(seconds);
            pairs.add_colour(Stamped { stamp, arrival: at(exposed + 0.02), picture: () });
            pairs.add_depth(Stamped { stamp, arrival: at(exposed + 0.12), picture: () });
            let (colour, _) = pairs.take_newest().unwrap();
            let taken = clock.taken(colour.stamp, colour.arrival).unwrap();
            assert!((taken - exposed).abs() < 1e-6, "{k}: {taken} for {exposed}");
        }
    }
}
