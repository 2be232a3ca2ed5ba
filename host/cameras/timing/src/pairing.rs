//! Pairing of colour and depth pictures by time.

use crate::sensor::Sensor;

/// Item with a time stamp.
pub trait Timed {
    /// Returns the time stamp, seconds on the device's clock.
    fn time(&self) -> f64;
}

/// Pairs the pictures of two streams by time.
///
/// A picture waits for its counterpart until a picture arrives that was taken too late for it. It
/// is then reported as unpaired. Streams that are out of step by more than `within` give no pair at
/// all.
#[derive(Debug, Clone)]
pub struct Pairing<T> {
    within: f64,
    waiting: Option<(Sensor, T)>,
}

/// Result of adding a picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Paired<T> {
    /// The picture waits for its counterpart.
    Pending,
    /// Colour and depth of one moment.
    Pair(T, T),
    /// The picture that waited has no counterpart; the added one waits now.
    Unpaired(Sensor, T),
    /// The added picture is older than the one that waits, and has no counterpart.
    Late(Sensor, T),
}

impl<T: Timed> Pairing<T> {
    /// Pairs pictures whose time stamps differ by at most `within` seconds.
    pub fn new(within: f64) -> Self {
        Self { within, waiting: None }
    }

    /// Returns the largest difference of the time stamps of a pair, seconds.
    pub fn within(&self) -> f64 {
        self.within
    }

    /// Adds the next picture of `sensor`.
    pub fn add(&mut self, sensor: Sensor, picture: T) -> Paired<T> {
        let Some((waited, other)) = self.waiting.take() else {
            self.waiting = Some((sensor, picture));
            return Paired::Pending;
        };
        let later = picture.time() - other.time();
        if waited != sensor && later.abs() <= self.within {
            return match sensor {
                Sensor::Depth => Paired::Pair(other, picture),
                Sensor::Colour => Paired::Pair(picture, other),
            };
        }
        // After a clock that was set back by more, the picture that waits is the old one.
        if waited != sensor && (-1.0..0.0).contains(&later) {
            self.waiting = Some((waited, other));
            return Paired::Late(sensor, picture);
        }
        self.waiting = Some((sensor, picture));
        Paired::Unpaired(waited, other)
    }
}

#[cfg(test)]
mod tests {
    use super::Sensor::{Colour, Depth};
    use super::*;

    impl Timed for f64 {
        fn time(&self) -> f64 {
            *self
        }
    }

    #[test]
    fn streams_in_step_are_paired_in_either_order() {
        let mut pairing = Pairing::new(0.02);
        for (first, second) in [(Colour, Depth), (Depth, Colour)] {
            for frame in 0..10 {
                let time = f64::from(frame) / 30.0;
                assert_eq!(pairing.add(first, time), Paired::Pending);
                let late = time + 0.015;
                let (colour, depth) = if second == Depth { (time, late) } else { (late, time) };
                assert_eq!(pairing.add(second, late), Paired::Pair(colour, depth));
            }
        }
        assert!(pairing.waiting.is_none());
    }

    #[test]
    fn a_lost_picture_leaves_one_unpaired() {
        let mut pairing = Pairing::new(0.02);
        assert_eq!(pairing.add(Colour, 0.0), Paired::Pending);
        // The depth picture of 0.0 was lost.
        assert_eq!(pairing.add(Colour, 0.033), Paired::Unpaired(Colour, 0.0));
        assert_eq!(pairing.add(Depth, 0.033), Paired::Pair(0.033, 0.033));
        assert_eq!(pairing.add(Depth, 0.066), Paired::Pending);
        assert_eq!(pairing.add(Colour, 0.1), Paired::Unpaired(Depth, 0.066));
        assert_eq!(pairing.add(Depth, 0.06), Paired::Late(Depth, 0.06));
        assert_eq!(pairing.add(Depth, 0.1), Paired::Pair(0.1, 0.1));
    }

    #[test]
    fn streams_out_of_step_give_no_pair() {
        let mut pairing = Pairing::new(0.01);
        let mut pairs = 0;
        for frame in 0..30 {
            let time = f64::from(frame) / 30.0;
            for (sensor, time) in [(Colour, time), (Depth, time + 0.0165)] {
                pairs += u32::from(matches!(pairing.add(sensor, time), Paired::Pair(..)));
            }
        }
        assert_eq!(pairs, 0);
    }

    #[test]
    fn a_clock_that_is_set_back_is_followed() {
        let mut pairing = Pairing::new(0.02);
        assert_eq!(pairing.add(Colour, 100.0), Paired::Pending);
        assert_eq!(pairing.add(Depth, 0.0), Paired::Unpaired(Colour, 100.0));
        assert_eq!(pairing.add(Colour, 0.001), Paired::Pair(0.001, 0.0));
    }
}
