//! Polynomials of degree 5 in space.

use nalgebra::Vector3;

/// Polynomial of degree 5 over the parameter u in [0, 1], metres.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Quintic {
    /// Coefficients of u⁰ to u⁵.
    coefficients: [Vector3<f64>; 6],
}

/// Place and derivatives by u at one end of a polynomial.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End {
    pub(crate) place: Vector3<f64>,
    pub(crate) first: Vector3<f64>,
    pub(crate) second: Vector3<f64>,
}

/// Place and derivatives by u at a parameter.
pub(crate) type Derivatives = End;

/// Rows of Pascal's triangle up to 5.
const BINOMIALS: [[f64; 6]; 6] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0, 0.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, 1.0],
];

impl Quintic {
    /// Returns the straight line between two places.
    pub(crate) fn line(from: Vector3<f64>, to: Vector3<f64>) -> Self {
        let mut coefficients = [Vector3::zeros(); 6];
        (coefficients[0], coefficients[1]) = (from, to - from);
        Self { coefficients }
    }

    /// Returns the Bézier curve of these control points.
    pub(crate) fn bezier(control: [Vector3<f64>; 6]) -> Self {
        let coefficients = std::array::from_fn(|power| {
            let term = |(i, point): (usize, &Vector3<f64>)| {
                let sign = if (power - i).is_multiple_of(2) { 1.0 } else { -1.0 };
                point * (sign * BINOMIALS[power][i])
            };
            let sum: Vector3<f64> = control[..=power].iter().enumerate().map(term).sum();
            sum * BINOMIALS[5][power]
        });
        Self { coefficients }
    }

    /// Returns the polynomial between two ends.
    pub(crate) fn between(from: &End, to: &End) -> Self {
        let rise = to.place - from.place;
        let (v, w) = (from.first, to.first);
        let (a, b) = (from.second, to.second);
        let coefficients = [
            from.place,
            v,
            a * 0.5,
            rise * 10.0 - v * 6.0 - w * 4.0 - a * 1.5 + b * 0.5,
            rise * -15.0 + v * 8.0 + w * 7.0 + a * 1.5 - b,
            rise * 6.0 - v * 3.0 - w * 3.0 - a * 0.5 + b * 0.5,
        ];
        Self { coefficients }
    }

    /// Returns place, first and second derivative at `u`.
    pub(crate) fn at(&self, u: f64) -> Derivatives {
        let (mut place, mut first, mut half) =
            (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        for coefficient in self.coefficients.iter().rev() {
            half = half * u + first;
            first = first * u + place;
            place = place * u + coefficient;
        }
        Derivatives { place, first, second: half * 2.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Vector3<f64>, b: Vector3<f64>) -> bool {
        (a - b).norm() < 1e-12
    }

    #[test]
    fn a_bezier_curve_begins_and_ends_along_its_control_points() {
        let control: [Vector3<f64>; 6] =
            std::array::from_fn(|i| Vector3::new(i as f64, (i * i) as f64, (i % 3) as f64));
        let curve = Quintic::bezier(control);
        assert!(close(curve.at(0.0).place, control[0]));
        assert!(close(curve.at(1.0).place, control[5]));
        assert!(close(curve.at(0.0).first, (control[1] - control[0]) * 5.0));
        assert!(close(curve.at(1.0).first, (control[5] - control[4]) * 5.0));
        let bend = control[2] - control[1] * 2.0 + control[0];
        assert!(close(curve.at(0.0).second, bend * 20.0));
    }

    #[test]
    fn a_polynomial_has_the_ends_that_it_was_made_from() {
        let end = |a: f64| End {
            place: Vector3::new(a, 1.0, -a),
            first: Vector3::new(0.3, a, 0.1),
            second: Vector3::new(-a, 0.2, 2.0 * a),
        };
        let (from, to) = (end(1.0), end(-0.5));
        let curve = Quintic::between(&from, &to);
        for (u, expected) in [(0.0, from), (1.0, to)] {
            let found = curve.at(u);
            assert!(close(found.place, expected.place));
            assert!(close(found.first, expected.first));
            assert!(close(found.second, expected.second));
        }
    }
}
