//! Clock of the stamps of a camera's node: its rate against this computer's clock, the time between
//! two pictures, and the times of exposure on the host's clock.

use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use plumb_frame::clock::{SenderClock, SenderClockError};

/// Ratios of the clock of the stamps to this computer's at which the age of a picture is known.
const RATES: RangeInclusive<f64> = 0.95..=1.05;

/// Time of pictures after which a right rate is certain.
const HEARD: Duration = Duration::from_millis(500);

/// Time of pictures after which a wrong rate is certain. Before, it may be that some of them came
/// late.
const JUDGING: Duration = Duration::from_secs(4);

/// Time in which the fastest picture counts.
const WINDOW: Duration = Duration::from_millis(200);

/// Stamp of a picture and its arrival.
#[derive(Debug, Clone, Copy)]
struct Taken {
    /// Seconds on the clock of the camera's computer.
    stamp: f64,
    arrival: Instant,
}

/// The fastest picture of a window.
#[derive(Debug, Clone, Copy)]
struct Window {
    begin: Instant,
    least: Taken,
}

/// Finding about a clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Finding {
    /// Too few pictures have come.
    Open,
    /// The clock runs as this computer's.
    Right,
    /// The clock runs at so many times the rate of this computer's.
    Wrong(f64),
}

/// Estimate of the rate of the clock of the stamps, from the fastest pictures.
#[derive(Debug, Default)]
pub(super) struct ClockRate(Vec<Window>);

impl ClockRate {
    /// Adds a picture with this `stamp` (seconds).
    pub(super) fn add(&mut self, stamp: f64, arrival: Instant) {
        let taken = Taken { stamp, arrival };
        match self.0.last_mut() {
            Some(last) if arrival.saturating_duration_since(last.begin) < WINDOW => {
                last.least = last.least.less_delayed(taken);
            }
            _ => self.0.push(Window { begin: arrival, least: taken }),
        }
    }

    /// Returns what the pictures say about the clock. One that is wrong is so in the first half of
    /// the time and in the second one: a computer that was busy once delays pictures in one half.
    pub(super) fn finding(&self) -> Finding {
        let [Some(first), Some(middle), Some(last)] =
            [0, self.0.len() / 2, self.0.len().saturating_sub(1)].map(|at| self.0.get(at))
        else {
            return Finding::Open;
        };
        let [first, middle, last] = [first, middle, last].map(|window| window.least);
        let passed = last.arrival.saturating_duration_since(first.arrival);
        let rate = first.rate(last);
        if passed >= HEARD && RATES.contains(&rate) {
            return Finding::Right;
        }
        if passed < JUDGING - WINDOW {
            return Finding::Open;
        }
        let is_right = |rate| RATES.contains(&rate);
        match [first.rate(middle), middle.rate(last)].map(is_right) {
            [false, false] => Finding::Wrong(rate),
            _ => Finding::Right,
        }
    }
}

impl Taken {
    /// Returns the picture of these two that arrived sooner after its stamp.
    fn less_delayed(self, other: Self) -> Self {
        let passed = other.arrival.saturating_duration_since(self.arrival).as_secs_f64();
        if other.stamp - self.stamp > passed { other } else { self }
    }

    /// Returns the rate of the stamps up to a `later` picture.
    fn rate(self, later: Self) -> f64 {
        let passed = later.arrival.saturating_duration_since(self.arrival).as_secs_f64();
        (later.stamp - self.stamp) / passed
    }
}

/// Number of differences of stamps that are kept.
const KEPT: usize = 16;

/// Time between two pictures.
///
/// It is the lower quartile of the last differences of stamps: lost pictures make some differences
/// longer, and a node that stamps its pictures late makes some shorter.
#[derive(Debug, Default)]
pub(super) struct Period {
    last: Option<f64>,
    differences: VecDeque<f64>,
}

impl Period {
    /// Adds the stamp of the next picture, seconds. A stamp that does not grow begins anew.
    pub(super) fn add(&mut self, stamp: f64) {
        let difference = self.last.replace(stamp).map(|last| stamp - last);
        let Some(difference) = difference.filter(|difference| *difference > 0.0) else { return };
        if self.differences.len() == KEPT {
            self.differences.pop_front();
        }
        self.differences.push_back(difference);
    }

    /// Returns the period, seconds; `None` before two pictures.
    pub(super) fn seconds(&self) -> Option<f64> {
        let mut sorted = Vec::from(self.differences.clone());
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 4).copied()
    }
}

/// Mapping of the stamps of a camera's node to the host's clock.
#[derive(Debug)]
pub(super) struct ExposureClock {
    sender: SenderClock,
    /// Time from exposure to arrival of the fastest picture, seconds.
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
    use super::*;
    use crate::camera::pairs::{Pairs, Stamped};
    use std::time::Duration;

    /// Returns the first finding that is not open on pictures at `hertz` with a clock of this
    /// `rate`, whose delay is `delay(seconds)`, and the seconds until it.
    fn finding(rate: f64, hertz: f64, delay: impl Fn(f64) -> f64) -> (Finding, f64) {
        let (begin, mut clock) = (Instant::now(), ClockRate::default());
        (0..1000_u32)
            .find_map(|k| {
                let taken = f64::from(k) / hertz;
                let arrival = taken + delay(taken);
                clock.add(1.8e9 + rate * taken, begin + Duration::from_secs_f64(arrival));
                let finding = clock.finding();
                (finding != Finding::Open).then_some((finding, arrival))
            })
            .unwrap()
    }

    #[test]
    fn the_clock_of_a_bag_or_a_simulator_that_is_slower_or_faster_is_wrong() {
        for rate in [0.0, 0.5, 0.9, 1.1, 2.0, -1.0] {
            for hertz in [2.0, 30.0, 90.0] {
                let (finding, after) = finding(rate, hertz, |_| 0.03);
                let Finding::Wrong(found) = finding else {
                    panic!("{rate} at {hertz}: {finding:?}")
                };
                assert!((found - rate).abs() < 0.01, "{found} for {rate}");
                assert!((3.5..5.0).contains(&after), "{after} s");
            }
        }
    }

    #[test]
    fn a_right_clock_is_known_in_a_second_also_where_pictures_are_late() {
        for hertz in [2.0, 30.0, 90.0] {
            let (finding, after) = finding(1.0, hertz, |_| 0.03);
            assert_eq!(finding, Finding::Right, "{hertz}");
            assert!(after < 1.1, "{hertz}: {after} s");
        }
        let (busy, _) = finding(1.0, 30.0, |taken| 0.06 * (17.0 * taken).sin().abs());
        assert_eq!(busy, Finding::Right);
        // Half a second behind at the beginning.
        let (late, _) = finding(1.0, 30.0, |taken| if taken < 0.5 { 0.5 } else { 0.0 });
        assert_eq!(late, Finding::Right);
    }

    #[test]
    fn before_two_windows_nothing_is_known() {
        let mut clock = ClockRate::default();
        assert_eq!(clock.finding(), Finding::Open);
        clock.add(5.0, Instant::now());
        assert_eq!(clock.finding(), Finding::Open);
    }

    /// Returns the period of pictures with these stamps.
    fn period(stamps: impl IntoIterator<Item = f64>) -> Option<f64> {
        let mut period = Period::default();
        stamps.into_iter().for_each(|stamp| period.add(stamp));
        period.seconds()
    }

    #[test]
    fn the_period_is_known_from_the_second_picture_on() {
        assert_eq!(period([]), None);
        assert_eq!(period([5.0]), None);
        assert_eq!(period([5.0, 5.25]), Some(0.25));
        // A clock that was set.
        assert_eq!(period([5.0, 5.25, 1.0, 1.25]), Some(0.25));
    }

    #[test]
    fn lost_pictures_and_late_stamps_do_not_change_it() {
        let near = |period: Option<f64>| (period.unwrap() - 0.1).abs() < 1e-9;
        // Two of three pictures are lost, now and then.
        let lost = (0..100).filter(|k| k % 10 < 4 || k % 3 == 0);
        assert!(near(period(lost.map(|k| f64::from(k) * 0.1))));
        // Every fifth picture is stamped 80 ms late.
        let late = |k: i32| if k % 5 == 0 { 0.08 } else { 0.0 };
        assert!(near(period((0..100).map(|k| f64::from(k) * 0.1 + late(k)))));
    }

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
