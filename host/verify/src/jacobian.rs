//! α and β: bounds of |J_ik| over a kind of rigs or along a way.

use super::rigs::{Cell, Shape};
use super::search::{least, within};
use super::{Interval, Rigs, Way};

/// Bounds are told to this part of themselves.
const TOLERANCE: f64 = 0.005;

/// Cells after which the bounds are told as they are: safe, but loose.
const MOST_CELLS: usize = 300_000;

/// An entry of |J| that may be less is taken for one that may be 0.
const VANISHING: f64 = 1e-4;

/// Safe bounds of the entries of |J| that are not zero by the signs; metres of ball a metre of
/// cable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Magnitudes {
    /// Not above the least one; 0 where that is under 10⁻⁴.
    pub alpha: f64,
    /// Not below the largest one.
    pub beta: f64,
}

impl Magnitudes {
    /// β/α, the only thing about them that matters to the law (15); infinite where α is 0.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.beta / self.alpha
    }
}

/// The least and the largest of the |J_ik| of a shape, J_yC apart, which is 0; within which they
/// are.
fn extremes(s: &Shape) -> [Interval; 2] {
    let one = Interval::point(1.0);
    let [a, b, c] = s.lengths;
    let rows = [
        [s.t * a / s.w, (one - s.t) * b / s.w, c / s.w],
        [a, b, a],
        [s.lambda[0] * a / s.h, s.lambda[1] * b / s.h, s.lambda[2] * c / s.h],
    ];
    let entries = rows.as_flattened();
    [
        entries.iter().fold(Interval::point(f64::INFINITY), |least, v| least.min(*v)),
        entries.iter().fold(Interval::point(0.0), |most, v| most.max(*v)),
    ]
}

/// α and β over all `rigs`: the better of what bisection of J's exact structure gives, to half a
/// percent of the best there are where 300 000 cells do for that, and of [`rough`].
#[must_use]
pub fn over_rigs(rigs: &Rigs) -> Magnitudes {
    let whole = Cell::whole(rigs);
    let sizes = whole.0.map(|side| side.width().max(1e-9));
    let halves = |cell: &Cell| {
        let mut halves = cell.halves(sizes).to_vec();
        halves.retain(|half| half.contains_some(rigs));
        halves
    };
    let (bisected, by_hand) =
        (bounds(whole, |cell| cell.shape(rigs.least_lambda), halves), rough(rigs));
    Magnitudes { alpha: bisected.alpha.max(by_hand.alpha), beta: bisected.beta.min(by_hand.beta) }
}

/// α and β along a way, to half a percent of the best there are.
#[must_use]
pub fn over_way(way: &Way) -> Magnitudes {
    bounds(
        Interval::new(0.0, 1.0),
        |part| way.cell(*part).shape(0.0),
        |part| part.halves().to_vec(),
    )
}

/// α and β over what `whole` is bisected into.
fn bounds<C: Copy>(
    whole: C,
    shape: impl Fn(&C) -> Shape,
    halves: impl Fn(&C) -> Vec<C>,
) -> Magnitudes {
    let known = |value: Interval| within(TOLERANCE)(value) || value.magnitude().hi < VANISHING;
    let bound = |value: &dyn Fn(&C) -> Interval| {
        least(vec![whole], value, &halves, known, MOST_CELLS).map_or(0.0, |found| found.value.lo)
    };
    let alpha = bound(&|cell| extremes(&shape(cell))[0]);
    Magnitudes {
        alpha: if alpha < VANISHING { 0.0 } else { alpha },
        beta: -bound(&|cell| -extremes(&shape(cell))[1]),
    }
}

/// α and β by hand, from rough geometry alone: safe, in a few operations.
///
/// Derived here from J = K diag(l) of docs/understand/plant.md; the paper's own formulas, (22) and
/// (23), were not at hand. Let m be the least λ, s the longest side of the triangle and a = D W/s
/// its least altitude. The ball is between (1 - λ_k) a and (1 - λ_k) s from motor k as seen from
/// above, and λ_k is from m to 1 - 2m. So
///
/// ```text
/// l from √(h² + (2m a)²), h the least, to √(h² + ((1 - m) s)²), h the largest
/// |J_xk| = l_A t/W, l_B (1 - t)/W, l_C/W     |J_yk| = l_A/D, l_B/D
/// |J_zk| = λ √(1 + (l²-h²)/h²) from m √(1 + ((1 - m) a/h)²), h the largest, to √((1 - 2m)² + (s/4h)²), h the least
/// ```
///
/// where λ² + λ²(1 - λ)² (a/h)² is least at λ = m, and λ (1 - λ) <= 1/4.
#[must_use]
pub fn rough(rigs: &Rigs) -> Magnitudes {
    let (one, m) = (Interval::point(1.0), Interval::point(rigs.least_lambda));
    let (nearest, farthest) = (Interval::point(rigs.below.lo), Interval::point(rigs.below.hi));
    let hypot = |x: Interval, y: Interval| (x.square() + y.square()).sqrt();
    let slant = |part: Interval| hypot(rigs.width, part * rigs.depth);
    let side = rigs.depth.max(slant(rigs.apex)).max(slant(one - rigs.apex));
    let altitude = rigs.depth * rigs.width / side;
    let shortest = hypot(nearest, 2.0 * m * altitude).lo;
    let longest = hypot(farthest, (one - m) * side).hi;
    let lengths = Interval::new(shortest, longest);
    let level = [
        rigs.apex * lengths / rigs.width,
        (one - rigs.apex) * lengths / rigs.width,
        lengths / rigs.depth,
    ];
    let lowest = m * hypot(one, (one - m) * altitude / farthest);
    let highest = hypot(one - 2.0 * m, side / (4.0 * nearest));
    let largest = (lengths / rigs.width).max(highest);
    Magnitudes {
        alpha: level.iter().fold(lowest, |least, v| least.min(*v)).lo.max(0.0),
        beta: level.iter().fold(largest, |most, v| most.max(*v)).hi,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use plumb_emulator::rig::Geometry;
    use proptest::prelude::*;

    use super::*;

    const MOTORS: [[f64; 3]; 3] = [[0.85, 0.61, 0.665], [0.85, 0.0, 0.665], [0.0, 0.24, 0.665]];
    const BELOW: Interval = Interval::new(0.1, 0.665);

    /// docs/understand/proofs.md: 30, 42, 79, 181 for λ >= 0.10, 0.05, 0.023, 0.01, and 36.5 from
    /// P0 to PT.
    #[test]
    fn the_papers_rig_has_the_ratios_of_the_control_notes() {
        for (lambda, ratio) in [(0.10, 30.0), (0.05, 42.0), (0.023, 79.0), (0.01, 181.0)] {
            let rigs = Rigs::around(&MOTORS, 0.0, lambda, BELOW).unwrap();
            let found = over_rigs(&rigs);
            assert!(
                (found.ratio() / ratio - 1.0).abs() < 0.02,
                "λ >= {lambda}: {found:?}, {}",
                found.ratio()
            );
        }
        let way = Way::new(&MOTORS, [0.540, 0.220, 0.459], [0.400, 0.400, 0.150]).unwrap();
        assert!((over_way(&way).ratio() / 36.5 - 1.0).abs() < 0.01, "{}", over_way(&way).ratio());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5))]

        /// What the emulator's own kinematics say of a rig and a place lies in both bounds.
        #[test]
        fn bounds_hold_for_true_jacobians(
            (depth, width, apex) in (0.5f64..1.5, 0.5f64..1.5, 0.15f64..0.85),
            (lambda, height, tolerance) in (0.03f64..0.2, 0.1f64..0.5, 0.0f64..0.01),
            places in proptest::collection::vec((0.0f64..1.0, 0.0f64..1.0, 0.0f64..1.0), 20),
        ) {
            let motors = [[width, depth, 1.0], [width, 0.0, 1.0], [0.0, apex * depth, 1.0]];
            let rigs = Rigs::around(&motors, tolerance, lambda, Interval::new(height, 0.9)).unwrap();
            let (exact, rough) = (over_rigs(&rigs), rough(&rigs));
            let geometry = Geometry::new(motors.map(Point3::from), [0.015; 3]).unwrap();
            for (p, q, r) in places {
                let (p, q) = if p + q > 1.0 { (1.0 - p, 1.0 - q) } else { (p, q) };
                let by = [p, q, 1.0 - p - q].map(|part| lambda + part * (1.0 - 3.0 * lambda));
                let at = |i: usize| (0..3).map(|k| by[k] * motors[k][i]).sum::<f64>();
                let ball = Point3::new(at(0), at(1), 1.0 - (height + r * (0.9 - height)));
                let j = geometry.jacobian(&ball).unwrap();
                for (i, k) in (0..9).map(|n| (n / 3, n % 3)).filter(|at| *at != (1, 2)) {
                    let size = j[(i, k)].abs();
                    for found in [exact, rough] {
                        prop_assert!(found.alpha <= size && size <= found.beta * (1.0 + 1e-12), "{size} {found:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_way_out_of_the_triangle_is_refused() {
        assert!(Way::new(&MOTORS, [0.540, 0.220, 0.459], [0.2, 0.6, 0.15]).is_err());
        assert!(Way::new(&MOTORS, [0.540, 0.220, 0.459], [0.4, 0.4, 0.7]).is_err());
    }
}
