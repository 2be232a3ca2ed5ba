//! Which colour picture belongs to which depth picture.

use crate::picture::Sensor;

/// What has a time stamp.
pub trait Timed {
    /// Seconds on the device's clock.
    fn time(&self) -> f64;
}

/// Pairs two streams by time.
///
/// A picture waits for its counterpart until one comes that was taken too late for it; it is alone
/// then, and said to be. Streams that run apart by more than `within` give no pair at all, which is
/// how it is noticed.
#[derive(Debug, Clone)]
pub struct Pairing<T> {
    within: f64,
    waiting: Option<(Sensor, T)>,
}

/// What became of a picture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Paired<T> {
    /// It waits for its counterpart.
    Waits,
    /// Colour and depth of one moment.
    Pair(T, T),
    /// The other one, which waited, has no counterpart; this one waits now.
    Alone(Sensor, T),
    /// This one is older than the one that waits; it has none.
    Late(Sensor, T),
}

impl<T: Timed> Pairing<T> {
    /// For pictures that are of one moment where they were taken `within` so many seconds.
    pub fn new(within: f64) -> Self {
        Self { within, waiting: None }
    }

    /// How far apart a pair may be, seconds.
    pub(crate) fn within(&self) -> f64 {
        self.within
    }

    /// Takes the next picture of `sensor`.
    pub(crate) fn add(&mut self, sensor: Sensor, picture: T) -> Paired<T> {
        let Some((waited, other)) = self.waiting.take() else {
            self.waiting = Some((sensor, picture));
            return Paired::Waits;
        };
        let later = picture.time() - other.time();
        if waited != sensor && later.abs() <= self.within {
            return match sensor {
                Sensor::Depth => Paired::Pair(other, picture),
                Sensor::Colour => Paired::Pair(picture, other),
            };
        }
        // A clock that was set back makes the one that waits the old one, not this.
        if waited != sensor && (-1.0..0.0).contains(&later) {
            self.waiting = Some((waited, other));
            return Paired::Late(sensor, picture);
        }
        self.waiting = Some((sensor, picture));
        Paired::Alone(waited, other)
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
    fn in_step_everything_is_paired_in_either_order() {
        let mut pairing = Pairing::new(0.02);
        for (first, second) in [(Colour, Depth), (Depth, Colour)] {
            for frame in 0..10 {
                let time = f64::from(frame) / 30.0;
                assert_eq!(pairing.add(first, time), Paired::Waits);
                let late = time + 0.015;
                let (colour, depth) = if second == Depth { (time, late) } else { (late, time) };
                assert_eq!(pairing.add(second, late), Paired::Pair(colour, depth));
            }
        }
        assert!(pairing.waiting.is_none());
    }

    #[test]
    fn a_lost_picture_leaves_one_alone_and_no_more() {
        let mut pairing = Pairing::new(0.02);
        assert_eq!(pairing.add(Colour, 0.0), Paired::Waits);
        // The depth picture of 0.0 was lost.
        assert_eq!(pairing.add(Colour, 0.033), Paired::Alone(Colour, 0.0));
        assert_eq!(pairing.add(Depth, 0.033), Paired::Pair(0.033, 0.033));
        assert_eq!(pairing.add(Depth, 0.066), Paired::Waits);
        assert_eq!(pairing.add(Colour, 0.1), Paired::Alone(Depth, 0.066));
        assert_eq!(pairing.add(Depth, 0.06), Paired::Late(Depth, 0.06));
        assert_eq!(pairing.add(Depth, 0.1), Paired::Pair(0.1, 0.1));
    }

    #[test]
    fn out_of_step_nothing_is_paired() {
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
        assert_eq!(pairing.add(Colour, 100.0), Paired::Waits);
        assert_eq!(pairing.add(Depth, 0.0), Paired::Alone(Colour, 100.0));
        assert_eq!(pairing.add(Colour, 0.001), Paired::Pair(0.001, 0.0));
    }
}
