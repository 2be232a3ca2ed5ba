//! Polylines with fewer corners.
//!
//! Waypoints that lie dense on a smooth curve make a polyline with many small corners. Each of them
//! would be rounded by a curve as short as its sides, whose curvature changes fast, and the ball
//! would have to be slow. Method: Douglas, Peucker, "Algorithms for the reduction of the number of
//! points required to represent a digitized line or its caricature", Cartographica 10 (1973).

use nalgebra::Vector3;

use crate::motion::LEAST_DISTANCE_M;

/// Polyline with fewer corners.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Simplified {
    /// Corners with the two ends, metres.
    pub(crate) stations: Vec<Vector3<f64>>,
    /// Largest distance of a corner that was left out from the polyline, metres.
    pub(crate) deviation: f64,
}

/// Leaves out the corners of a polyline that are within `tolerance` (metres) of the line between
/// the others. The two ends stay. Those of a closed polyline are the same place.
pub(crate) fn simplify(stations: &[Vector3<f64>], tolerance: f64) -> Simplified {
    let mut kept = vec![false; stations.len()];
    let mut deviation = 0.0_f64;
    let mut spans: Vec<(usize, usize)> = vec![(0, stations.len() - 1)];
    while let Some((from, to)) = spans.pop() {
        (kept[from], kept[to]) = (true, true);
        let Some((farthest, distance)) = farthest(stations, from, to) else { continue };
        // The line between the ends of a closed polyline has no direction.
        let is_closed = (stations[to] - stations[from]).norm() < LEAST_DISTANCE_M;
        if is_closed || distance > tolerance {
            spans.extend([(from, farthest), (farthest, to)]);
        } else {
            deviation = deviation.max(distance);
        }
    }
    let stations = stations.iter().zip(kept).filter(|(_, kept)| *kept);
    Simplified { stations: stations.map(|(station, _)| *station).collect(), deviation }
}

/// Returns the station between two others that is farthest from the line between them, and its
/// distance, metres; `None` where there is none between them.
fn farthest(stations: &[Vector3<f64>], from: usize, to: usize) -> Option<(usize, f64)> {
    let (begin, end) = (stations[from], stations[to]);
    let between = (from + 1..to).map(|index| (index, distance(stations[index], begin, end)));
    between.max_by(|(_, a), (_, b)| a.total_cmp(b))
}

/// Returns the distance of a place from the line between two others, metres.
fn distance(place: Vector3<f64>, from: Vector3<f64>, to: Vector3<f64>) -> f64 {
    let line = to - from;
    let share = (place - from).dot(&line) / line.norm_squared();
    let nearest = if share.is_finite() { from + line * share.clamp(0.0, 1.0) } else { from };
    (place - nearest).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns places on a circle of 0.1 m, with this distance between them, metres.
    fn circle(spacing: f64, count: u32) -> Vec<Vector3<f64>> {
        let place = |k: u32| {
            let angle = f64::from(k) * spacing / 0.1;
            Vector3::new(0.1 * angle.cos(), 0.1 * angle.sin(), 0.3)
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn dense_places_become_few_within_the_tolerance() {
        let dense = circle(0.001, 400);
        let Simplified { stations, deviation } = simplify(&dense, 0.001);
        assert!((10..25).contains(&stations.len()), "{}", stations.len());
        assert_eq!((stations[0], stations[stations.len() - 1]), (dense[0], dense[399]));
        let near = |place: &Vector3<f64>| {
            let sides = stations.windows(2).map(|side| distance(*place, side[0], side[1]));
            sides.fold(f64::INFINITY, f64::min)
        };
        let farthest = dense.iter().map(near).fold(0.0, f64::max);
        assert!(farthest <= deviation && deviation <= 0.001, "{farthest} {deviation}");
    }

    #[test]
    fn corners_and_turns_back_stay() {
        let places =
            [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.2, 0.1]].map(|[x, y]| Vector3::new(x, y, 0.3));
        let kept = Simplified { stations: places.to_vec(), deviation: 0.0 };
        assert_eq!(simplify(&places, 0.001), kept);
        assert_eq!(simplify(&places[..2], 0.001).stations, places[..2]);
    }

    /// The profile of some hundred corners within a millimetre took seconds to compute.
    #[test]
    fn places_that_are_all_within_the_tolerance_become_a_line() {
        let places = circle(1e-6, 300);
        assert_eq!(simplify(&places, 0.001).stations, [places[0], places[299]]);
        let closed = [&places[..], &places[..1]].concat();
        assert_eq!(simplify(&closed, 0.001).stations, [places[0], places[299], places[0]]);
    }

    #[test]
    fn a_closed_polyline_that_is_smaller_than_the_tolerance_stays_one() {
        let corner = Vector3::new(0.0005, 0.0, 0.3);
        let places = [Vector3::new(0.0, 0.0, 0.3), corner, Vector3::new(0.0, 0.0, 0.3)];
        assert_eq!(simplify(&places, 0.001).stations, places);
    }
}
