//! Curves through waypoints: straight lines with rounded corners.
//!
//! A quintic Bézier curve rounds a corner. Its control points are at the distances d, 2d/3 and d/3
//! from the corner on both sides, so that its curvature is zero where it meets the lines, and the
//! curvature of the whole curve is continuous. Method: Sencer, Ishizaki, Shamoto, "A curvature
//! optimal sharp corner smoothing algorithm for high-speed feed motion generation of NC systems
//! along linear tool paths", Int. J. Adv. Manuf. Technol. 76 (2015).

use nalgebra::{Point3, Vector3};

use crate::curve::{Curve, Section};
use crate::motion::{LEAST_DISTANCE_M, PathError, Run, Waypoints};
use crate::quintic::Quintic;
use crate::simplify::{Simplified, simplify};

/// Distance of the middle of the Bézier curve from the corner, as a share of d·|v - u| with u and v
/// the directions before and after the corner: (1 + 5·2/3 + 10·1/3) / 32.
const MIDDLE_SHARE: f64 = 23.0 / 96.0;

/// Angle between the directions beyond which the ball stops at a corner, as a cosine: 160°. The
/// rounded corner would be a hairpin.
const HAIRPIN_COSINE: f64 = -0.939_7;

/// Angle between the directions below which a corner counts as straight, as |v - u|, radians. The
/// jump of the tangent changes the velocity by less than a millionth.
const STRAIGHT: f64 = 1e-7;

/// Share of the tolerance within which corners are left out. The rest is for rounding: on a circle
/// of 10 cm with 5 mm of tolerance, corners are then 28 mm apart, and the ball passes them at
/// 6 cm/s.
const SIMPLIFIED_SHARE: f64 = 0.2;

/// Length above which a line between two rounded corners is a section of its own, metres.
const LEAST_LINE_M: f64 = 1e-9;

/// Side of a path: a straight line between two waypoints.
struct Side {
    from: Vector3<f64>,
    to: Vector3<f64>,
    direction: Vector3<f64>,
    length: f64,
    /// Largest speed, m/s.
    speed: f64,
}

/// Corner between two sides.
enum Corner {
    /// The ball passes it on a curve that begins and ends at this distance from it, metres; 0 where
    /// the sides are in one line.
    Round(f64),
    /// The ball stops there.
    Stop,
}

impl Side {
    fn new(from: Vector3<f64>, to: Vector3<f64>, speed: f64) -> Self {
        let length = (to - from).norm();
        Self { from, to, direction: (to - from) / length, length, speed }
    }

    /// Returns the line between the rounded corners at both ends; `None` where they meet.
    fn line(&self, cut_from: f64, cut_to: f64) -> Option<Quintic> {
        let length = self.length - cut_from - cut_to;
        let from = self.from + self.direction * cut_from;
        (length > LEAST_LINE_M).then(|| Quintic::line(from, self.to - self.direction * cut_to))
    }
}

impl Corner {
    /// Returns the corner between two sides, with this largest distance of its curve, metres.
    fn between(before: &Side, after: &Side, tolerance: f64) -> Self {
        let bend = (after.direction - before.direction).norm();
        if bend < STRAIGHT {
            return Self::Round(0.0);
        }
        if tolerance <= 0.0 || before.direction.dot(&after.direction) < HAIRPIN_COSINE {
            return Self::Stop;
        }
        let half = before.length.min(after.length) / 2.0;
        Self::Round((tolerance / (MIDDLE_SHARE * bend)).min(half))
    }

    fn cut(&self) -> f64 {
        if let Self::Round(distance) = self { *distance } else { 0.0 }
    }

    /// Returns the curve that rounds the corner; `None` where there is none.
    fn curve(&self, before: &Side, after: &Side) -> Option<Quintic> {
        let Self::Round(distance) = *self else { return None };
        let third = distance / 3.0;
        let at = |side: &Side, thirds: f64| after.from + side.direction * (third * thirds);
        let control = [
            at(before, -3.0),
            at(before, -2.0),
            at(before, -1.0),
            at(after, 1.0),
            at(after, 2.0),
            at(after, 3.0),
        ];
        (distance > 0.0).then(|| Quintic::bezier(control))
    }
}

/// Returns the curve that passes the places of `waypoints` within their tolerance: with fewer
/// corners where places are dense, and with rounded ones. A loop goes from the last place back to
/// the first. It begins in the middle of the first side, or near to it where places are dense.
pub(crate) fn blend(waypoints: &Waypoints, run: Run) -> Result<Curve, PathError> {
    let stations = Stations::new(waypoints, run)?;
    let (stations, deviation) = stations.simplified(SIMPLIFIED_SHARE * waypoints.tolerance);
    let tolerance = waypoints.tolerance - deviation;
    let sides = stations.sides();
    let count = sides.len();
    let next = |i: usize| (i + 1) % count;
    let is_closed = run == Run::Loop;
    let corners: Vec<Corner> = (0..count)
        .map(|i| match i + 1 == count && !is_closed {
            true => Corner::Stop,
            false if stations.0[i + 1].stops => Corner::Stop,
            false => Corner::between(&sides[i], &sides[next(i)], tolerance),
        })
        .collect();
    let mut chain = Chain::default();
    for (i, side) in sides.iter().enumerate() {
        let before = match i {
            0 if !is_closed => 0.0,
            _ => corners[(i + count - 1) % count].cut(),
        };
        chain.push(side.line(before, corners[i].cut()), side.speed);
        let after = &sides[next(i)];
        chain.push(corners[i].curve(side, after), side.speed.min(after.speed));
        chain.stops = matches!(corners[i], Corner::Stop);
    }
    Ok(chain.curve(is_closed))
}

/// Sections of a curve under construction.
#[derive(Default)]
struct Chain {
    sections: Vec<Section>,
    /// Whether the ball must stop before the next section.
    stops: bool,
}

impl Chain {
    fn push(&mut self, polynomial: Option<Quintic>, speed: f64) {
        let Some(polynomial) = polynomial else { return };
        self.sections.push(Section { polynomial, stops: std::mem::take(&mut self.stops), speed });
    }

    /// Returns the curve. The stop after the last section of a loop is before the first one.
    fn curve(mut self, is_closed: bool) -> Curve {
        if is_closed && let Some(first) = self.sections.first_mut() {
            first.stops = self.stops;
        }
        Curve::new(self.sections, is_closed)
    }
}

/// Place of a path.
#[derive(Debug, Clone, Copy)]
struct Station {
    /// The place, metres.
    place: Vector3<f64>,
    /// Whether the ball stops there; the ends of a path do not count.
    stops: bool,
    /// Largest speed from here to the next place, m/s.
    speed: f64,
}

/// Places of a path; those of a loop from the middle of the first side back to it.
struct Stations(Vec<Station>);

impl Stations {
    /// Makes the places of a path. The ball stops where a place follows itself.
    fn new(waypoints: &Waypoints, run: Run) -> Result<Self, PathError> {
        let near = |a: &Station, b: &Vector3<f64>| (a.place - b).norm() < LEAST_DISTANCE_M;
        let speeds = waypoints.speeds.iter().copied().chain(std::iter::repeat(f64::INFINITY));
        let mut stations: Vec<Station> = Vec::new();
        for (&Point3 { coords: place }, speed) in waypoints.places.iter().zip(speeds) {
            match stations.last_mut() {
                Some(last) if near(last, &place) => (last.stops, last.speed) = (true, speed),
                _ => stations.push(Station { place, stops: false, speed }),
            }
        }
        if stations.len() < 2 {
            return Err(PathError::TooFew { count: stations.len(), least: 2 });
        }
        if run == Run::Loop {
            let (first, last) = (stations[0], stations[stations.len() - 1]);
            if near(&first, &last.place) {
                stations.pop();
                stations[0].stops |= last.stops;
            }
            let middle = (stations[0].place + stations[1].place) / 2.0;
            let middle = Station { place: middle, stops: false, speed: first.speed };
            stations.rotate_left(1);
            stations.insert(0, middle);
            stations.push(middle);
        }
        Ok(Self(stations))
    }

    /// Returns the straight lines between the places.
    fn sides(&self) -> Vec<Side> {
        let pairs = self.0.windows(2);
        pairs.map(|pair| Side::new(pair[0].place, pair[1].place, pair[0].speed)).collect()
    }

    /// Returns the places with fewer corners between those at which the ball stops or gets another
    /// speed, and the largest distance of a place that was left out, metres.
    fn simplified(&self, tolerance: f64) -> (Self, f64) {
        let mut few = vec![self.0[0]];
        let mut largest = 0.0_f64;
        let mut from = 0;
        for to in 1..self.0.len() {
            let Station { stops, speed, .. } = self.0[to];
            if !(stops || speed != self.0[from].speed || to == self.0.len() - 1) {
                continue;
            }
            let places: Vec<_> = self.0[from..=to].iter().map(|station| station.place).collect();
            let Simplified { stations, deviation } = simplify(&places, tolerance);
            let speed = self.0[from].speed;
            let between = &stations[1..stations.len() - 1];
            few.extend(between.iter().map(|&place| Station { place, stops: false, speed }));
            few.push(self.0[to]);
            largest = largest.max(deviation);
            from = to;
        }
        (Self(few), largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the curve through places without speeds of their own.
    fn blend(places: &[Point3<f64>], tolerance: f64, run: Run) -> Result<Curve, PathError> {
        super::blend(&Waypoints { places: places.to_vec(), speeds: Vec::new(), tolerance }, run)
    }

    fn corner(degrees: f64) -> Vec<Point3<f64>> {
        let angle = degrees.to_radians();
        let corner = Point3::new(0.2, 0.0, 0.3);
        let after = Vector3::new(angle.cos(), angle.sin() * 0.6, angle.sin() * 0.8);
        vec![Point3::new(0.0, 0.0, 0.3), corner, corner + after * 0.2]
    }

    fn distance(curve: &Curve, place: &Point3<f64>) -> f64 {
        let at = |i: usize| curve.at(curve.length() * i as f64 / 10_000.0).place;
        (0..=10_000).map(|i| (at(i) - place.coords).norm()).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_rounded_corner_passes_at_the_tolerance() {
        for degrees in [10.0, 45.0, 90.0, 135.0, 155.0] {
            let places = corner(degrees);
            let curve = blend(&places, 0.005, Run::Once).unwrap();
            let found = distance(&curve, &places[1]);
            // A corner of 10° would need more than half of a side.
            let expected = if degrees < 20.0 { 0.0041 } else { 0.005 };
            assert!((found - expected).abs() < 1e-4, "{degrees}: {found}");
        }
    }

    #[test]
    fn tangent_and_curvature_are_continuous_along_a_rounded_corner() {
        let curve = blend(&corner(90.0), 0.005, Run::Once).unwrap();
        let step = curve.length() / 100_000.0;
        for i in 1..100_000 {
            let (a, b) = (curve.at(step * f64::from(i - 1)), curve.at(step * f64::from(i)));
            assert!((a.tangent - b.tangent).norm() < 0.002);
            assert!((a.curvature - b.curvature).norm() < 0.3, "{i}");
        }
    }

    #[test]
    fn a_hairpin_and_a_corner_without_tolerance_are_stops() {
        let stops = |curve: &Curve| curve.intervals().filter(|piece| piece.stops).count();
        assert_eq!(stops(&blend(&corner(165.0), 0.005, Run::Once).unwrap()), 1);
        assert_eq!(stops(&blend(&corner(90.0), 0.0, Run::Once).unwrap()), 1);
        assert_eq!(stops(&blend(&corner(90.0), 0.005, Run::Once).unwrap()), 0);
        let line = [Point3::new(0.0, 0.0, 0.3), Point3::new(0.2, 0.0, 0.3)];
        let there_and_back = blend(&line, 0.005, Run::Loop).unwrap();
        assert_eq!(stops(&there_and_back), 2);
        assert!((there_and_back.length() - 0.4).abs() < 1e-12);
    }

    #[test]
    fn a_loop_may_repeat_its_first_waypoint_at_the_end() {
        let square = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2], [0.0, 0.0]];
        let places = square.map(|[x, y]| Point3::new(x, y, 0.3));
        let [open, closed] = [&places[..4], &places[..]].map(|places| {
            let curve = blend(places, 0.005, Run::Loop).unwrap();
            curve.length()
        });
        assert_eq!(open, closed);
    }

    #[test]
    fn a_loop_begins_in_the_middle_of_its_first_side_where_the_second_one_goes_on_straight() {
        let places = [[0.0, 0.0], [0.02, 0.0], [0.2, 0.0], [0.2, 0.2]];
        let places = places.map(|[x, y]| Point3::new(x, y, 0.3));
        let begin = blend(&places, 0.005, Run::Loop).unwrap().at(0.0).place;
        assert!((begin - Vector3::new(0.01, 0.0, 0.3)).norm() < 1e-12, "{begin}");
    }

    #[test]
    fn waypoints_in_one_place_are_refused() {
        let place = Point3::new(0.2, 0.1, 0.3);
        for path in [&[place, place][..], &[place]] {
            let error = blend(path, 0.005, Run::Once).unwrap_err();
            assert!(matches!(error, PathError::TooFew { count: 1, .. }), "{error}");
        }
    }

    #[test]
    fn the_ball_stops_where_a_waypoint_is_repeated() {
        let stops = |path: &[Point3<f64>], run| {
            let curve = blend(path, 0.005, run).unwrap();
            let at: Vec<f64> =
                curve.intervals().filter(|piece| piece.stops).map(|piece| piece.from).collect();
            (at, curve.length())
        };
        let square = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2]];
        let [a, b, c, d] = square.map(|[x, y]| Point3::new(x, y, 0.3));
        let (at, length) = stops(&[a, a, b, c, c, c, d, d], Run::Once);
        assert!(at.len() == 1 && length < 0.6, "{at:?} {length}");
        // Straight on, too: it would be left out.
        let middle = Point3::new(0.1, 0.0, 0.3);
        let (at, _) = stops(&[a, middle, middle, b], Run::Once);
        assert!(at.len() == 1 && (at[0] - 0.1).abs() < 1e-12, "{at:?}");
        // A loop has no ends: it stops at its first waypoint.
        for path in [&[a, a, b, c, d][..], &[a, b, c, d, a, a]] {
            assert_eq!(stops(path, Run::Loop).0.len(), 1);
        }
        assert_eq!(stops(&[a, b, c, d, a], Run::Loop).0.len(), 0);
    }
}
