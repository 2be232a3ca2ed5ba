//! A curve in space by its arc length.

use nalgebra::Vector3;

use crate::quintic::Quintic;

/// Number of parts into which the table of arc lengths divides a polynomial.
const PARTS: usize = 16;

/// Nodes and weights of the Gauss-Legendre quadrature with 5 points on [0, 1]. Source: Abramowitz
/// and Stegun, Handbook of Mathematical Functions, table 25.4.
const NODES: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Number of Newton steps from an arc length to its parameter.
const NEWTON_STEPS: usize = 4;

/// Curve of polynomials, one after the other, with a continuous tangent and curvature except at the
/// stops.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    pieces: Vec<Piece>,
    /// Whether the end is the start.
    pub(crate) is_closed: bool,
}

/// Polynomial with its arc length.
#[derive(Debug, Clone)]
struct Piece {
    polynomial: Quintic,
    /// Arc length of the curve before the piece, metres.
    start: f64,
    /// Arc lengths from the start of the piece to the ends of its parts, metres.
    lengths: [f64; PARTS],
    /// Whether the ball must stop at the start of the piece.
    stops: bool,
    /// Largest speed, m/s.
    speed: f64,
}

/// Piece of a curve: a polynomial.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    pub(crate) polynomial: Quintic,
    /// Whether the ball must stop where the section begins: its tangent jumps there.
    pub(crate) stops: bool,
    /// Largest speed, beside that of the whole curve, m/s; infinite where there is none.
    pub(crate) speed: f64,
}

/// Place, unit tangent and curvature vector of a curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurvePoint {
    /// Place, metres.
    pub(crate) place: Vector3<f64>,
    /// First derivative by the arc length.
    pub(crate) tangent: Vector3<f64>,
    /// Second derivative by the arc length, 1/m.
    pub(crate) curvature: Vector3<f64>,
}

impl Piece {
    fn new(section: Section, start: f64) -> Self {
        let Section { polynomial, stops, speed } = section;
        let lengths = lengths(&polynomial);
        Self { polynomial, start, lengths, stops, speed }
    }

    fn length(&self) -> f64 {
        self.lengths[PARTS - 1]
    }

    /// Returns the parameter at the arc length `s` from the start of the piece.
    fn parameter(&self, s: f64) -> f64 {
        let part = self.lengths.partition_point(|end| *end < s).min(PARTS - 1);
        let before = if part == 0 { 0.0 } else { self.lengths[part - 1] };
        let [from, to] = [part, part + 1].map(|edge| edge as f64 / PARTS as f64);
        let share = (s - before) / (self.lengths[part] - before);
        let mut u = from + share * (to - from);
        for _ in 0..NEWTON_STEPS {
            let error = before + arc_length(&self.polynomial, from, u) - s;
            let slope = self.polynomial.at(u).first.norm();
            u = (u - error / slope).clamp(from, to);
        }
        u
    }
}

/// Returns the arc length of a polynomial between two parameters, metres.
fn arc_length(polynomial: &Quintic, from: f64, to: f64) -> f64 {
    let speed = |node: f64| polynomial.at(from + node * (to - from)).first.norm();
    NODES.iter().map(|(node, weight)| weight * speed(*node)).sum::<f64>() * (to - from)
}

/// Returns the arc lengths of a polynomial from its start to the ends of its parts, metres.
fn lengths(polynomial: &Quintic) -> [f64; PARTS] {
    let mut length = 0.0;
    std::array::from_fn(|part| {
        let [from, to] = [part, part + 1].map(|edge| edge as f64 / PARTS as f64);
        length += arc_length(polynomial, from, to);
        length
    })
}

/// Returns the arc length of a whole polynomial, metres.
pub(crate) fn whole_length(polynomial: &Quintic) -> f64 {
    lengths(polynomial)[PARTS - 1]
}

impl Curve {
    /// Returns the curve of these sections, at least one. No section has length 0.
    pub(crate) fn new(sections: Vec<Section>, is_closed: bool) -> Self {
        let mut start = 0.0;
        let piece = |section: Section| {
            let piece = Piece::new(section, start);
            start += piece.length();
            piece
        };
        Self { pieces: sections.into_iter().map(piece).collect(), is_closed }
    }

    /// Returns the length, metres.
    pub(crate) fn length(&self) -> f64 {
        self.pieces.last().map_or(0.0, |piece| piece.start + piece.length())
    }

    /// Returns the point at the arc length `s`, metres. A closed curve goes on beyond its end;
    /// another one ends there.
    pub(crate) fn at(&self, s: f64) -> CurvePoint {
        let length = self.length();
        let s = if self.is_closed { s.rem_euclid(length) } else { s.clamp(0.0, length) };
        let index = self.pieces.partition_point(|piece| piece.start <= s).max(1) - 1;
        let piece = &self.pieces[index];
        let at = piece.polynomial.at(piece.parameter((s - piece.start).min(piece.length())));
        let speed = at.first.norm();
        let tangent = at.first / speed;
        let normal = at.second - tangent * tangent.dot(&at.second);
        CurvePoint { place: at.place, tangent, curvature: normal / (speed * speed) }
    }

    /// Returns the parts of the pieces in their order. Where the curvature changes fast, they are
    /// short: they divide the parameter of a piece evenly.
    pub(crate) fn intervals(&self) -> impl Iterator<Item = Interval> {
        self.pieces.iter().flat_map(|piece| {
            (0..PARTS).map(|part| Interval {
                from: piece.start + if part == 0 { 0.0 } else { piece.lengths[part - 1] },
                to: piece.start + piece.lengths[part],
                stops: piece.stops && part == 0,
                speed: piece.speed,
            })
        })
    }
}

/// Interval of arc length of a part of a piece.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interval {
    /// Begin, metres.
    pub(crate) from: f64,
    /// End, metres.
    pub(crate) to: f64,
    /// Whether the ball must stop at the start.
    pub(crate) stops: bool,
    /// Largest speed, beside that of the whole curve, m/s.
    pub(crate) speed: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::{Ends, interpolate};

    /// Returns a circle of radius 0.1 m through 64 places.
    fn circle() -> Curve {
        let place = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / 64.0;
            Vector3::new(0.1 * angle.cos(), 0.1 * angle.sin(), 0.3)
        };
        let places: Vec<_> = (0..=64).map(place).collect();
        let pieces = interpolate(&places, &[1.0; 64], Ends::Periodic);
        let section = |polynomial| Section { polynomial, stops: false, speed: f64::INFINITY };
        Curve::new(pieces.into_iter().map(section).collect(), true)
    }

    #[test]
    fn the_length_and_the_curvature_of_a_circle_are_right() {
        let circle = circle();
        assert!((circle.length() - std::f64::consts::TAU * 0.1).abs() < 1e-6);
        for i in 0..1000 {
            let s = 0.001 * f64::from(i);
            let point = circle.at(s);
            let expected = Vector3::new(0.1 * (s / 0.1).cos(), 0.1 * (s / 0.1).sin(), 0.3);
            assert!((point.place - expected).norm() < 1e-6);
            assert!((point.curvature.norm() - 10.0).abs() < 0.02, "{}", point.curvature.norm());
            assert!(point.curvature.dot(&point.tangent).abs() < 1e-9);
        }
    }

    #[test]
    fn the_parameter_is_the_arc_length() {
        let circle = circle();
        for i in 0..500 {
            let (s, step) = (0.0011 * f64::from(i), 1e-4);
            let chord = (circle.at(s + step).place - circle.at(s - step).place).norm();
            assert!((chord - 2.0 * step).abs() < 1e-9, "{chord}");
        }
    }
}
