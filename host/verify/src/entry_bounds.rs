//! Bounds α and β of |J_ik| over a family of rigs or along a path.

use super::branch_and_bound::{minimise, relative_width};
use super::{BallPath, Interval, RigFamily};
use crate::rig_family::{Cell, Geometry};

/// Relative width of the enclosures of α and β.
const TOLERANCE: f64 = 0.005;

/// Number of cells after which the search ends. The bounds are valid at any time, but less tight
/// before convergence.
const MAX_CELLS: usize = 300_000;

/// An entry of |J| with a lower bound below this counts as one that may be 0.
const VANISHING: f64 = 1e-4;

/// Side of a cell below which it is not split relative to its own size (points have width 0).
const MIN_SCALE: f64 = 1e-9;

/// Bounds of the entries of |J| that are not zero by the sign pattern (12), in metres of ball per
/// metre of cable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EntryBounds {
    /// Lower bound of the smallest entry; 0 if that is below 10⁻⁴.
    pub alpha: f64,
    /// Upper bound of the largest entry.
    pub beta: f64,
}

impl EntryBounds {
    /// Returns β/α, on which law (15) depends; infinite if α is 0.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.beta / self.alpha
    }
}

/// Encloses the smallest and the largest |J_ik| of a geometry, without J_yC, which is 0.
fn extremes(g: &Geometry) -> [Interval; 2] {
    let one = Interval::point(1.0);
    let [a, b, c] = g.lengths;
    let rows = [
        [g.t * a / g.w, (one - g.t) * b / g.w, c / g.w],
        [a, b, a],
        [g.lambda[0] * a / g.h, g.lambda[1] * b / g.h, g.lambda[2] * c / g.h],
    ];
    let entries = rows.as_flattened();
    [
        entries.iter().fold(Interval::point(f64::INFINITY), |smallest, v| smallest.min(*v)),
        entries.iter().fold(Interval::point(0.0), |largest, v| largest.max(*v)),
    ]
}

/// Returns α and β over a family of rigs.
///
/// Each is the tighter of two bounds: branch and bound on the exact J, within half a percent of the
/// optimum if 300 000 cells suffice, and [`closed_form_bounds`].
#[must_use]
pub fn bounds_over_rigs(rigs: &RigFamily) -> EntryBounds {
    let whole = Cell::whole(rigs);
    let scales = whole.0.map(|side| side.width().max(MIN_SCALE));
    let halves = |cell: &Cell| {
        let mut halves = cell.halves(scales).to_vec();
        halves.retain(|half| half.may_intersect(rigs));
        halves
    };
    let exact = bounds(whole, |cell| cell.geometry(rigs.min_lambda), halves);
    let closed_form = closed_form_bounds(rigs);
    EntryBounds {
        alpha: exact.alpha.max(closed_form.alpha),
        beta: exact.beta.min(closed_form.beta),
    }
}

/// Returns α and β along a path, within half a percent of the optimum.
#[must_use]
pub fn bounds_along_path(path: &BallPath) -> EntryBounds {
    bounds(
        Interval::new(0.0, 1.0),
        |part| path.cell(*part).geometry(0.0),
        |part| part.halves().to_vec(),
    )
}

/// Returns α and β over `whole`, by branch and bound with `halves`.
fn bounds<C: Copy>(
    whole: C,
    geometry: impl Fn(&C) -> Geometry,
    halves: impl Fn(&C) -> Vec<C>,
) -> EntryBounds {
    let converged =
        |value: Interval| relative_width(TOLERANCE)(value) || value.magnitude().hi < VANISHING;
    let lower_bound = |enclosure: &dyn Fn(&C) -> Interval| {
        minimise(vec![whole], enclosure, &halves, converged, MAX_CELLS)
            .map_or(0.0, |minimum| minimum.value.lo)
    };
    let alpha = lower_bound(&|cell| extremes(&geometry(cell))[0]);
    EntryBounds {
        alpha: if alpha < VANISHING { 0.0 } else { alpha },
        beta: -lower_bound(&|cell| -extremes(&geometry(cell))[1]),
    }
}

/// Returns α and β in closed form, from the extents of the family alone.
///
/// Derived here from J = K diag(l) of docs/understand/plant.md. The text of the paper's own
/// formulas, (22) and (23), was not available.
///
/// Let m be the minimum of λ, s the longest side of the triangle and a = D W/s its smallest
/// altitude. Seen from above, the distance of the ball from motor k is from (1 - λ_k) a to
/// (1 - λ_k) s, and λ_k is from m to 1 - 2m. With h from h₁ to h₂:
///
/// ```text
/// l        from √(h₁² + (2m a)²) to √(h₂² + ((1 - m) s)²)
/// |J_xk|   = l_A t/W, l_B (1 - t)/W, l_C/W
/// |J_yk|   = l_A/D, l_B/D
/// |J_zk|   = λ √(1 + (l² - h²)/h²)
///          from m √(1 + ((1 - m) a/h₂)²) to √((1 - 2m)² + (s/4h₁)²)
/// ```
///
/// The last row holds because λ² + λ²(1 - λ)² (a/h)² has its minimum at λ = m, and
/// λ (1 - λ) <= 1/4.
#[must_use]
pub fn closed_form_bounds(rigs: &RigFamily) -> EntryBounds {
    let (one, m) = (Interval::point(1.0), Interval::point(rigs.min_lambda));
    let (h1, h2) = (Interval::point(rigs.below.lo), Interval::point(rigs.below.hi));
    let hypot = |x: Interval, y: Interval| (x.square() + y.square()).sqrt();
    let slant = |part: Interval| hypot(rigs.width, part * rigs.depth);
    let side = rigs.depth.max(slant(rigs.apex)).max(slant(one - rigs.apex));
    let altitude = rigs.depth * rigs.width / side;
    let shortest = hypot(h1, 2.0 * m * altitude).lo;
    let longest = hypot(h2, (one - m) * side).hi;
    let lengths = Interval::new(shortest, longest);
    let horizontal = [
        rigs.apex * lengths / rigs.width,
        (one - rigs.apex) * lengths / rigs.width,
        lengths / rigs.depth,
    ];
    let vertical_min = m * hypot(one, (one - m) * altitude / h2);
    let vertical_max = hypot(one - 2.0 * m, side / (4.0 * h1));
    let largest = (lengths / rigs.width).max(vertical_max);
    EntryBounds {
        alpha: horizontal.iter().fold(vertical_min, |min, v| min.min(*v)).lo.max(0.0),
        beta: horizontal.iter().fold(largest, |max, v| max.max(*v)).hi,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use plumb_emulator::plant::Geometry;
    use plumb_protocol::{PerAxis, PerMotor};
    use proptest::prelude::*;

    use super::*;

    const MOTORS: PerMotor<PerAxis<f64>> =
        [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]];
    const BELOW: Interval = Interval::new(0.1, 0.665);

    /// docs/understand/proofs.md: 30, 42, 79, 181 for λ >= 0.10, 0.05, 0.023, 0.01, and 36.5 from
    /// P0 to PT.
    #[test]
    fn the_papers_rig_has_the_documented_ratios() {
        for (lambda, ratio) in [(0.10, 30.0), (0.05, 42.0), (0.023, 79.0), (0.01, 181.0)] {
            let rigs = RigFamily::around(&MOTORS, 0.0, lambda, BELOW).unwrap();
            let found = bounds_over_rigs(&rigs);
            let error = (found.ratio() / ratio - 1.0).abs();
            assert!(error < 0.02, "λ >= {lambda}: {found:?}, {}", found.ratio());
        }
        let path = BallPath::new(&MOTORS, [0.540, 0.220, 0.459], [0.400, 0.400, 0.150]).unwrap();
        let ratio = bounds_along_path(&path).ratio();
        assert!((ratio / 36.5 - 1.0).abs() < 0.01, "{ratio}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5))]

        /// The Jacobians of the emulator's kinematics are within both bounds.
        #[test]
        fn bounds_hold_for_true_jacobians(
            (depth, width, apex) in (0.5f64..1.5, 0.5f64..1.5, 0.15f64..0.85),
            (lambda, height, tolerance) in (0.03f64..0.2, 0.1f64..0.5, 0.0f64..0.01),
            places in proptest::collection::vec((0.0f64..1.0, 0.0f64..1.0, 0.0f64..1.0), 20),
        ) {
            let motors = [[width, depth, 1.0], [width, 0.0, 1.0], [0.0, apex * depth, 1.0]];
            let below = Interval::new(height, 0.9);
            let rigs = RigFamily::around(&motors, tolerance, lambda, below).unwrap();
            let both = [bounds_over_rigs(&rigs), closed_form_bounds(&rigs)];
            let geometry = Geometry::new(motors.map(Point3::from), [0.015; 3]).unwrap();
            for (p, q, r) in places {
                let (p, q) = if p + q > 1.0 { (1.0 - p, 1.0 - q) } else { (p, q) };
                let by = [p, q, 1.0 - p - q].map(|part| lambda + part * (1.0 - 3.0 * lambda));
                let at = |i: usize| (0..3).map(|k| by[k] * motors[k][i]).sum::<f64>();
                let ball = Point3::new(at(0), at(1), 1.0 - (height + r * (0.9 - height)));
                let j = geometry.jacobian(&ball).unwrap();
                for (i, k) in (0..9).map(|n| (n / 3, n % 3)).filter(|at| *at != (1, 2)) {
                    let size = j[(i, k)].abs();
                    for found in both {
                        let upper = found.beta * (1.0 + 1e-12);
                        prop_assert!(found.alpha <= size && size <= upper, "{size} {found:?}");
                    }
                }
            }
        }
    }
}
