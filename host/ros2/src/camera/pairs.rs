//! Pairs of colour and depth pictures by the stamps of their headers.

use std::collections::VecDeque;

/// Number of pictures of one kind that wait for their counterparts. Depth that is aligned to colour
/// takes longer than colour, and the two topics come in any order.
const WAITING: usize = 8;

/// Largest difference of the stamps of a pair, seconds: less than half the time between two
/// pictures at 30 frames/s.
pub(crate) const WITHIN: f64 = 0.013;

/// Picture with its stamp.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stamped<T> {
    /// Stamp of the header, seconds on the clock of the camera's computer.
    pub(crate) stamp: f64,
    /// The picture.
    pub(crate) picture: T,
}

/// Colour and depth pictures that wait for their counterparts. The newest pair wins.
#[derive(Debug)]
pub(crate) struct Pairs<C, D> {
    colour: VecDeque<Stamped<C>>,
    depth: VecDeque<Stamped<D>>,
    /// Difference of the stamps of the last pictures that came without a counterpart, seconds.
    apart: Option<f64>,
}

impl<C, D> Default for Pairs<C, D> {
    fn default() -> Self {
        Self { colour: VecDeque::new(), depth: VecDeque::new(), apart: None }
    }
}

impl<C, D> Pairs<C, D> {
    /// Adds a colour picture.
    pub(crate) fn add_colour(&mut self, picture: Stamped<C>) {
        add(&mut self.colour, picture);
    }

    /// Adds a depth picture.
    pub(crate) fn add_depth(&mut self, picture: Stamped<D>) {
        add(&mut self.depth, picture);
    }

    /// Removes and returns the newest pair, and drops the older pictures.
    pub(crate) fn take_newest(&mut self) -> Option<(Stamped<C>, Stamped<D>)> {
        for index in (0..self.colour.len()).rev() {
            let stamp = self.colour[index].stamp;
            let apart = |depth: &Stamped<D>| (depth.stamp - stamp).abs();
            let nearest = (0..self.depth.len())
                .min_by(|&a, &b| apart(&self.depth[a]).total_cmp(&apart(&self.depth[b])))?;
            self.apart = Some(apart(&self.depth[nearest]));
            if apart(&self.depth[nearest]) <= WITHIN {
                let colour = self.colour.drain(..=index).next_back();
                let depth = self.depth.drain(..=nearest).next_back();
                return colour.zip(depth);
            }
        }
        None
    }

    /// Returns the least difference of stamps that was found at the last attempt, seconds; `None`
    /// before both kinds of pictures have come.
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
        Stamped { stamp, picture: () }
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

    #[test]
    fn a_clock_that_is_set_back_is_followed() {
        let mut pairs = Pairs::default();
        pairs.add_colour(picture(100.0));
        pairs.add_colour(picture(1.0));
        pairs.add_depth(picture(1.0));
        assert_eq!(stamps(pairs.take_newest()), Some((1.0, 1.0)));
    }
}
