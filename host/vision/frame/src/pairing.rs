//! Pairing of the pictures of the two sensors of a camera, colour and depth, by time.

use std::collections::VecDeque;
use std::fmt;

/// Item with a time stamp.
pub trait Timed {
    /// Returns the time stamp, seconds on the device's clock.
    fn time(&self) -> f64;
}

/// Picture with the time of its exposure on the host's clock, which is read when it arrives.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken<T> {
    /// The picture, with its time stamp on the device's clock.
    pub picture: T,
    /// Time of its exposure, seconds.
    pub time: f64,
}

impl<T: Timed> Timed for Taken<T> {
    fn time(&self) -> f64 {
        self.picture.time()
    }
}

/// Largest number of pictures of one sensor that wait for those of the other: the later stream may
/// be as many periods behind.
const MAX_WAITING: usize = 4;

/// Difference of two time stamps from which on the clock was set, seconds.
const CLOCK_SET: f64 = 1.0;

/// Pairs the pictures of two streams by time.
///
/// A picture waits for its counterpart until one arrives that was taken later, or until too many
/// wait. It is then reported as unpaired. Streams that are out of step by more than `within` give
/// no pair at all.
///
/// ```
/// use plumb_frame::pairing::{Paired, Pairing, Sensor, Timed};
///
/// #[derive(Debug, PartialEq)]
/// struct Stamp(f64);
///
/// impl Timed for Stamp {
///     fn time(&self) -> f64 {
///         self.0
///     }
/// }
///
/// let mut pairing = Pairing::new(0.013);
/// pairing.add(Sensor::Depth, Stamp(1.000));
/// assert_eq!(pairing.take(), None);
/// pairing.add(Sensor::Colour, Stamp(1.002));
/// assert_eq!(pairing.take(), Some(Paired::Pair(Stamp(1.002), Stamp(1.000))));
/// ```
#[derive(Debug, Clone)]
pub struct Pairing<T> {
    within: f64,
    /// Sensor whose pictures wait.
    sensor: Sensor,
    /// Pictures without a counterpart so far, the oldest first.
    waiting: VecDeque<T>,
    /// Results that were not taken yet.
    results: VecDeque<Paired<T>>,
}

/// Result of adding pictures.
#[derive(Debug, Clone, PartialEq)]
pub enum Paired<T> {
    /// Colour and depth of one moment.
    Pair(T, T),
    /// A picture that has no counterpart.
    Unpaired(Sensor, T),
}

impl<T: Timed> Pairing<T> {
    /// Pairs pictures whose time stamps differ by at most `within` seconds.
    pub fn new(within: f64) -> Self {
        let (waiting, results) = (VecDeque::new(), VecDeque::new());
        Self { within, sensor: Sensor::Colour, waiting, results }
    }

    /// Returns the largest difference of the time stamps of a pair, seconds.
    pub fn within(&self) -> f64 {
        self.within
    }

    /// Returns the next result; `None` until more pictures come.
    pub fn take(&mut self) -> Option<Paired<T>> {
        self.results.pop_front()
    }

    /// Adds the next picture of `sensor`.
    pub fn add(&mut self, sensor: Sensor, picture: T) {
        let time = picture.time();
        let was_set = |other: &T| (time - other.time()).abs() > CLOCK_SET;
        if self.waiting.back().is_some_and(was_set) {
            self.give_up(self.waiting.len());
        }
        if sensor == self.sensor || self.waiting.is_empty() {
            self.sensor = sensor;
            self.waiting.push_back(picture);
            self.give_up(self.waiting.len().saturating_sub(MAX_WAITING));
            return;
        }
        // Those that were taken too early for this one have no counterpart.
        let early = self.waiting.iter().take_while(|other| other.time() < time - self.within);
        self.give_up(early.count());
        match self.waiting.front() {
            Some(other) if other.time() <= time + self.within => {
                let pair = self.waiting.pop_front().map(|other| match sensor {
                    Sensor::Depth => Paired::Pair(other, picture),
                    Sensor::Colour => Paired::Pair(picture, other),
                });
                self.results.extend(pair);
            }
            Some(_) => self.results.push_back(Paired::Unpaired(sensor, picture)),
            None => {
                self.sensor = sensor;
                self.waiting.push_back(picture);
            }
        }
    }

    /// Reports the `count` oldest pictures that wait as unpaired.
    fn give_up(&mut self, count: usize) {
        let sensor = self.sensor;
        self.results.extend(self.waiting.drain(..count).map(|it| Paired::Unpaired(sensor, it)));
    }
}

/// Sensor of an RGB-D camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// Red, green and blue.
    Colour,
    /// Depth along the optical axis.
    Depth,
}

impl Sensor {
    /// Returns the place of the sensor's state in an array: 0 for colour, 1 for depth.
    pub fn index(self) -> usize {
        match self {
            Self::Colour => 0,
            Self::Depth => 1,
        }
    }

    /// Returns the other sensor of a pair.
    pub fn other(self) -> Self {
        match self {
            Self::Colour => Self::Depth,
            Self::Depth => Self::Colour,
        }
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Colour => "colour",
            Self::Depth => "depth",
        })
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

    /// Adds pictures, and returns all results.
    fn added(pairing: &mut Pairing<f64>, pictures: &[(Sensor, f64)]) -> Vec<Paired<f64>> {
        pictures.iter().for_each(|&(sensor, time)| pairing.add(sensor, time));
        std::iter::from_fn(|| pairing.take()).collect()
    }

    #[test]
    fn streams_in_step_are_paired_in_either_order() {
        let mut pairing = Pairing::new(0.02);
        for (first, second) in [(Colour, Depth), (Depth, Colour)] {
            for frame in 0..10 {
                let (time, late) = (f64::from(frame) / 30.0, f64::from(frame) / 30.0 + 0.015);
                let (colour, depth) = if second == Depth { (time, late) } else { (late, time) };
                let results = added(&mut pairing, &[(first, time), (second, late)]);
                assert_eq!(results, [Paired::Pair(colour, depth)]);
            }
        }
        assert!(pairing.waiting.is_empty());
    }

    #[test]
    fn a_stream_may_be_some_periods_behind() {
        for behind in 1..=3 {
            let mut pairing = Pairing::new(0.4 / 60.0);
            let mut pairs = 0;
            for frame in 0..30 {
                let time = |frame: i32| f64::from(frame) / 60.0;
                let pictures = [(Colour, time(frame)), (Depth, time(frame - behind))];
                for result in added(&mut pairing, &pictures[..if frame < behind { 1 } else { 2 }]) {
                    assert!(matches!(result, Paired::Pair(..)), "{result:?}");
                    pairs += 1;
                }
            }
            assert_eq!(pairs, 30 - behind);
        }
    }

    #[test]
    fn lost_pictures_leave_their_counterparts_unpaired() {
        let mut pairing = Pairing::new(0.02);
        // The depth pictures of 0.0 and 0.1 were lost, and the colour picture of 0.066.
        let pictures = [(Colour, 0.0), (Colour, 0.033), (Depth, 0.033), (Colour, 0.1)];
        let results = added(&mut pairing, &pictures);
        assert_eq!(results, [Paired::Unpaired(Colour, 0.0), Paired::Pair(0.033, 0.033)]);
        let results = added(&mut pairing, &[(Depth, 0.066), (Depth, 0.133), (Colour, 0.133)]);
        let [a, b] = [(Depth, 0.066), (Colour, 0.1)].map(|(it, time)| Paired::Unpaired(it, time));
        assert_eq!(results, [a, b, Paired::Pair(0.133, 0.133)]);
    }

    #[test]
    fn a_stream_that_fell_silent_is_no_reason_to_wait_for_ever() {
        let mut pairing = Pairing::new(0.01);
        let pictures: Vec<_> = (0..10).map(|frame| (Depth, f64::from(frame) / 30.0)).collect();
        let results = added(&mut pairing, &pictures);
        assert_eq!(results.len(), 10 - MAX_WAITING);
        assert_eq!(results[0], Paired::Unpaired(Depth, 0.0));
    }

    #[test]
    fn streams_out_of_step_give_no_pair() {
        let mut pairing = Pairing::new(0.01);
        for frame in 0..30 {
            let time = f64::from(frame) / 30.0;
            let results = added(&mut pairing, &[(Colour, time), (Depth, time + 0.0165)]);
            assert!(results.iter().all(|result| matches!(result, Paired::Unpaired(..))));
        }
    }

    #[test]
    fn a_clock_that_is_set_is_followed() {
        let mut pairing = Pairing::new(0.02);
        let results = added(&mut pairing, &[(Colour, 100.0), (Depth, 0.0), (Colour, 0.001)]);
        assert_eq!(results, [Paired::Unpaired(Colour, 100.0), Paired::Pair(0.001, 0.0)]);
        let results = added(&mut pairing, &[(Colour, 0.03), (Colour, 500.0), (Depth, 500.0)]);
        assert_eq!(results, [Paired::Unpaired(Colour, 0.03), Paired::Pair(500.0, 500.0)]);
    }
}
