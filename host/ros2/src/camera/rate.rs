//! Rate of the clock of the stamps against this computer's clock.

use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

/// Ratios of the clock of the stamps to this computer's at which the age of a picture is known.
const RATES: RangeInclusive<f64> = 0.95..=1.05;

/// Time of pictures after which a right rate is certain.
const HEARD: Duration = Duration::from_millis(500);

/// Time of pictures after which a wrong rate is certain. Before, it may be that some of them came
/// late.
const JUDGING: Duration = Duration::from_secs(4);

/// Time in which the least delayed picture counts.
const WINDOW: Duration = Duration::from_millis(200);

/// Stamp of a picture and its arrival.
#[derive(Debug, Clone, Copy)]
struct Taken {
    /// Seconds on the clock of the camera's computer.
    stamp: f64,
    arrival: Instant,
}

/// The least delayed picture of a window.
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

/// Estimate of the rate of the clock of the stamps, from the least delayed pictures.
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
