//! Pairs of colour and depth pictures by the stamps of their headers.

use std::collections::VecDeque;
use std::time::Instant;

use super::rate::Period;

/// Number of pictures of one kind that wait for their counterparts. Depth that is aligned to colour
/// takes longer than colour, and the two topics come in any order.
const WAITING: usize = 8;

/// Largest difference of the stamps of a pair, in periods of the pictures: the depth of the next
/// picture is farther away.
const WITHIN_PERIODS: f64 = 0.4;

/// Largest difference of the stamps of a pair at any rate, seconds.
const WITHIN_S: f64 = 0.013;

/// Picture with its stamp.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stamped<T> {
    /// Stamp of the header, seconds on the clock of the camera's computer.
    pub(crate) stamp: f64,
    /// When it arrived.
    pub(crate) arrival: Instant,
    /// The picture.
    pub(crate) picture: T,
}

/// Colour and depth pictures that wait for their counterparts. The newest pair wins.
#[derive(Debug)]
pub(crate) struct Pairs<C, D> {
    colour: VecDeque<Stamped<C>>,
    depth: VecDeque<Stamped<D>>,
    /// Time between two colour pictures.
    period: Period,
    /// Difference of the stamps of the last pictures that came without a counterpart, seconds.
    apart: Option<f64>,
}

impl<C, D> Default for Pairs<C, D> {
    fn default() -> Self {
        let (colour, depth) = (VecDeque::new(), VecDeque::new());
        Self { colour, depth, period: Period::default(), apart: None }
    }
}

impl<C, D> Pairs<C, D> {
    /// Adds a colour picture.
    pub(crate) fn add_colour(&mut self, picture: Stamped<C>) {
        self.period.add(picture.stamp);
        add(&mut self.colour, picture);
    }

    /// Adds a depth picture.
    pub(crate) fn add_depth(&mut self, picture: Stamped<D>) {
        add(&mut self.depth, picture);
    }

    /// Removes and returns the newest pair, and drops the older pictures.
    pub(crate) fn take_newest(&mut self) -> Option<(Stamped<C>, Stamped<D>)> {
        let within = self.within();
        for index in (0..self.colour.len()).rev() {
            let stamp = self.colour[index].stamp;
            let apart = |depth: &Stamped<D>| (depth.stamp - stamp).abs();
            let nearest = (0..self.depth.len())
                .min_by(|&a, &b| apart(&self.depth[a]).total_cmp(&apart(&self.depth[b])))?;
            self.apart = Some(apart(&self.depth[nearest]));
            if apart(&self.depth[nearest]) <= within {
                self.apart = None;
                let colour = self.colour.drain(..=index).next_back();
                let depth = self.depth.drain(..=nearest).next_back();
                return colour.zip(depth);
            }
        }
        None
    }

    /// Returns the largest difference of the stamps of a pair, seconds: 0 before the period is
    /// known.
    fn within(&self) -> f64 {
        let period = self.period.seconds();
        period.map_or(0.0, |period| (WITHIN_PERIODS * period).min(WITHIN_S))
    }

    /// Returns the least difference of stamps that was found at the last attempt, seconds; `None`
    /// before both kinds of pictures have come, and after a pair.
    pub(crate) fn apart(&self) -> Option<f64> {
        self.apart
    }
}

/// Adds a picture to those that wait. A clock that is set back makes the older ones useless.
fn add<T>(waiting: &mut VecDeque<Stamped<T>>, picture: Stamped<T>) {
    if waiting.back().is_some_and(|last| picture.stamp < last.stamp) {
        waiting.clear();
    }
    if waiting.len() == WAITING {
        waiting.pop_front();
    }
    waiting.push_back(picture);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(stamp: f64) -> Stamped<()> {
        Stamped { stamp, arrival: Instant::now(), picture: () }
    }

    fn stamps(pair: Option<(Stamped<()>, Stamped<()>)>) -> Option<(f64, f64)> {
        pair.map(|(colour, depth)| (colour.stamp, depth.stamp))
    }

    #[test]
    fn depth_that_lags_by_several_pictures_is_paired() {
        let mut pairs = Pairs::default();
        let mut found = 0;
        for k in 0..30_u32 {
            let time = f64::from(k) / 30.0;
            pairs.add_colour(picture(time));
            if k >= 3 {
                let late = time - 0.1;
                pairs.add_depth(picture(late + 0.002));
                let (colour, depth) = stamps(pairs.take_newest()).unwrap();
                assert!((colour - late).abs() < 1e-9 && (depth - late - 0.002).abs() < 1e-9);
                found += 1;
            }
        }
        assert_eq!(found, 27);
    }

    #[test]
    fn the_newest_pair_wins_and_older_pictures_are_dropped() {
        let mut pairs = Pairs::default();
        for k in 0..3_u32 {
            pairs.add_depth(picture(f64::from(k)));
            pairs.add_colour(picture(f64::from(k)));
        }
        pairs.add_colour(picture(3.0));
        assert_eq!(stamps(pairs.take_newest()), Some((2.0, 2.0)));
        assert_eq!(pairs.apart(), None);
        assert_eq!(stamps(pairs.take_newest()), None);
        pairs.add_depth(picture(3.0));
        assert_eq!(stamps(pairs.take_newest()), Some((3.0, 3.0)));
    }

    #[test]
    fn pictures_of_different_times_are_no_pair() {
        let mut pairs = Pairs::default();
        for k in 0..100_u32 {
            pairs.add_colour(picture(f64::from(k) / 30.0));
            pairs.add_depth(picture(f64::from(k) / 30.0 + 0.0165));
            assert_eq!(stamps(pairs.take_newest()), None);
        }
        assert!(pairs.apart().is_some_and(|apart| (apart - 0.0165).abs() < 0.001));
        assert!(pairs.colour.len() <= WAITING && pairs.depth.len() <= WAITING);
    }

    /// Adds colour of the times `k / rate`, and each time depth that is `offset` later, with the
    /// depth of the last picture behind the colour of this one. Returns the stamps of the pairs.
    fn pairs_at(rate: f64, offset: f64) -> Vec<(f64, f64)> {
        let (mut pairs, mut found) = (Pairs::default(), Vec::new());
        for k in 0..100_u32 {
            let time = f64::from(k) / rate;
            pairs.add_colour(picture(time));
            pairs.add_depth(picture(time - 1.0 / rate + offset));
            found.extend(stamps(pairs.take_newest()));
        }
        found
    }

    #[test]
    fn at_90_hz_colour_is_not_paired_with_the_depth_before_it() {
        let found = pairs_at(90.0, 0.0);
        assert!(found.len() >= 98, "{found:?}");
        assert!(found.iter().all(|(colour, depth)| (colour - depth).abs() < 1e-9), "{found:?}");
    }

    #[test]
    fn an_offset_of_less_than_half_a_period_is_accepted() {
        for (rate, offset) in [(30.0, 0.010), (30.0, -0.012), (60.0, 0.006), (90.0, 0.004)] {
            let found = pairs_at(rate, offset);
            assert!(found.len() >= 97, "{rate} Hz: {found:?}");
            let is_right = |(colour, depth): &(f64, f64)| (depth - colour - offset).abs() < 1e-9;
            assert!(found.iter().all(is_right), "{rate} Hz: {found:?}");
        }
        assert_eq!(pairs_at(60.0, 0.5 / 60.0), []);
    }

    #[test]
    fn before_the_period_is_known_a_pair_has_equal_stamps() {
        let mut pairs = Pairs::default();
        pairs.add_colour(picture(5.0));
        pairs.add_depth(picture(5.001));
        assert_eq!(stamps(pairs.take_newest()), None);
        pairs.add_colour(picture(5.033));
        pairs.add_depth(picture(5.034));
        assert_eq!(stamps(pairs.take_newest()), Some((5.033, 5.034)));
        let mut pairs = Pairs::default();
        pairs.add_colour(picture(5.0));
        pairs.add_depth(picture(5.0));
        assert_eq!(stamps(pairs.take_newest()), Some((5.0, 5.0)));
    }

    #[test]
    fn a_clock_that_is_set_back_is_followed() {
        let mut pairs = Pairs::default();
        pairs.add_colour(picture(100.0));
        pairs.add_colour(picture(1.0));
        pairs.add_depth(picture(1.0));
        assert_eq!(stamps(pairs.take_newest()), Some((1.0, 1.0)));
    }
}
