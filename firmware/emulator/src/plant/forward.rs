//! Forward kinematics of cables that pull but cannot push: the lowest point within reach.
//!
//! A ball at rest minimises its height z subject to |p - M_i| <= l_i. The problem is convex and its
//! solution is unique. It is the lowest point of one sphere, of the circle where two spheres meet,
//! or of the two points where three spheres meet. Each of these seven candidates has a closed form.
//! The solution is the lowest candidate that all cables reach. The cables that do not define it are
//! slack: their multiplier, which is their tension, is zero. With two motors, only the three
//! candidates without the absent cable exist.

use nalgebra::{Point3, Vector3};
use plumb_protocol::{MOTORS, PerMotor};

use super::geometry::Geometry;
use super::interface::{NAMES, RigError};

/// Tolerance of a cable's reach for rounding errors, metres.
const REACH_TOLERANCE_M: f64 = 1e-10;

/// Rest position of the ball, and its slack cables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hang {
    /// Centre of the ball, metres in the rig frame.
    pub ball: Point3<f64>,
    /// Whether each cable is slack; order A, B, C. An absent cable is not.
    pub slack: PerMotor<bool>,
}

/// Returns the lowest point within reach of inextensible cables of these lengths (metres; order A,
/// B, C). The length of an absent cable has no effect.
///
/// # Errors
/// [`RigError::NoCable`] for a length of zero or less, [`RigError::TooShort`] or
/// [`RigError::TooShortTogether`] where no point is within reach of all cables,
/// [`RigError::OutOfRange`] for a length that is not finite.
pub fn lowest_point(geometry: &Geometry, lengths_m: PerMotor<f64>) -> Result<Hang, RigError> {
    geometry.check_lengths(lengths_m)?;
    let (motors, count) = (geometry.motors(), geometry.count());
    let within_reach = |p: &Point3<f64>| {
        let mut cables = motors.iter().zip(lengths_m).take(count);
        cables.all(|(m, l)| (p - m).norm() <= l + REACH_TOLERANCE_M)
    };
    let mut best: Option<Hang> = None;
    // Candidates with fewer cables come first, so that equal heights keep more slack cables. An
    // absent cable defines no candidate.
    for (candidate, slack) in candidates(motors, lengths_m) {
        if let Some(ball) = candidate
            && slack[count..].iter().all(|slack| *slack)
            && within_reach(&ball)
            && best.is_none_or(|b| ball.z < b.ball.z)
        {
            best = Some(Hang { ball, slack });
        }
    }
    let mut hang = best.ok_or_else(|| too_short(geometry, lengths_m))?;
    hang.slack[count..].fill(false);
    Ok(hang)
}

/// Returns the seven candidates for the lowest point, each with its slack cables.
fn candidates(
    motors: &PerMotor<Point3<f64>>,
    lengths: PerMotor<f64>,
) -> [(Option<Point3<f64>>, PerMotor<bool>); 7] {
    let below = |i: usize| Some(motors[i] - Vector3::z() * lengths[i]);
    let pair =
        |i: usize, j: usize| lowest_on_circle((motors[i], lengths[i]), (motors[j], lengths[j]));
    [
        (below(0), [false, true, true]),
        (below(1), [true, false, true]),
        (below(2), [true, true, false]),
        (pair(0, 1), [false, false, true]),
        (pair(1, 2), [true, false, false]),
        (pair(2, 0), [false, true, false]),
        (lower_intersection(motors, lengths), [false; MOTORS]),
    ]
}

/// Returns the square root of `square` (m²). A value that is negative only by rounding counts as
/// zero; a more negative one has no root. `scale_m` is the length that the tolerance refers to.
fn root(square: f64, scale_m: f64) -> Option<f64> {
    (square > -2.0 * scale_m * REACH_TOLERANCE_M).then(|| square.max(0.0).sqrt())
}

/// Returns the lowest point of the circle where two spheres (centre, radius) meet. Returns `None`
/// if they do not meet, or if the circle is level: the lowest point of one sphere is then as low or
/// lower.
fn lowest_on_circle(first: (Point3<f64>, f64), second: (Point3<f64>, f64)) -> Option<Point3<f64>> {
    let between = second.0 - first.0;
    let apart = between.norm();
    let axis = between.try_normalize(1e-9)?;
    let along = (apart * apart + first.1 * first.1 - second.1 * second.1) / (2.0 * apart);
    let radius = root(first.1 * first.1 - along * along, first.1)?;
    let down = (axis * axis.z - Vector3::z()).try_normalize(1e-9)?;
    Some(first.0 + axis * along + down * radius)
}

/// Returns the lower of the two points where three spheres meet (trilateration in a frame in the
/// motors' plane).
fn lower_intersection(
    motors: &PerMotor<Point3<f64>>,
    lengths: PerMotor<f64>,
) -> Option<Point3<f64>> {
    let [ab, ac] = [motors[1] - motors[0], motors[2] - motors[0]];
    let apart = ab.norm();
    let ex = ab.try_normalize(1e-9)?;
    let across = ac - ex * ac.dot(&ex);
    let ey = across.try_normalize(1e-9)?;
    let normal = ex.cross(&ey);
    let down = if normal.z > 0.0 { -normal } else { normal };
    let (i, j) = (ac.dot(&ex), across.norm());
    let [la, lb, lc] = lengths.map(|l| l * l);
    let x = (la - lb + apart * apart) / (2.0 * apart);
    let y = (la - lc + i * i + j * j - 2.0 * i * x) / (2.0 * j);
    let depth = root(la - x * x - y * y, lengths[0])?;
    Some(motors[0] + ex * x + ey * y + down * depth)
}

/// Returns the error that names the cables that cannot meet.
fn too_short(geometry: &Geometry, lengths_m: PerMotor<f64>) -> RigError {
    let (motors, count) = (geometry.motors(), geometry.count());
    for (i, j) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(|(i, j)| *i.max(j) < count) {
        let (sum_m, apart_m) = (lengths_m[i] + lengths_m[j], (motors[i] - motors[j]).norm());
        if sum_m < apart_m {
            return RigError::TooShort { first: NAMES[i], second: NAMES[j], sum_m, apart_m };
        }
    }
    RigError::TooShortTogether { lengths_m }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{planar_rig, proptest_config};
    use proptest::prelude::*;

    fn rig(heights: PerMotor<f64>) -> Geometry {
        let [a, b, c] = *Geometry::paper().motors();
        let up = |m: Point3<f64>, h| Point3::new(m.x, m.y, m.z + h);
        Geometry::new([up(a, heights[0]), up(b, heights[1]), up(c, heights[2])], [0.015; MOTORS])
            .unwrap()
    }

    /// Solves Σ a_i (M_i - p) = ẑ for the taut cables by least squares; returns (a, residual).
    fn multipliers(g: &Geometry, hang: &Hang) -> (Vec<f64>, f64) {
        let taut = (0..g.count()).filter(|i| !hang.slack[*i]).map(|i| g.motors()[i] - hang.ball);
        let e = nalgebra::DMatrix::from_columns(
            &taut.map(|c| nalgebra::DVector::from_column_slice(c.as_slice())).collect::<Vec<_>>(),
        );
        let z = nalgebra::DVector::from_vec(vec![0.0, 0.0, 1.0]);
        let a = e.clone().svd(true, true).solve(&z, 1e-12).unwrap();
        let residual = (&e * &a - z).norm();
        (a.iter().copied().collect(), residual)
    }

    #[test]
    fn a_long_cable_hangs_slack() {
        let g = Geometry::paper();
        let hang = lowest_point(&g, [0.7, 0.75, 1.5]).unwrap();
        assert_eq!(hang.slack, [false, false, true]);
        assert!(
            (hang.ball.x - 0.85).abs() < 1e-12,
            "two cables hang in the plane of their motors: {}",
            hang.ball
        );
        let one = lowest_point(&g, [2.0, 2.0, 0.5]).unwrap();
        assert_eq!(one.slack, [true, true, false]);
        assert!((one.ball - Point3::new(0.0, 0.24, 0.165)).norm() < 1e-12);
    }

    #[test]
    fn a_motor_right_below_another_one() {
        let [a, _, c] = *Geometry::paper().motors();
        let beside = Point3::new(a.x + 1e-3, a.y - 0.01, a.z - 0.5);
        let g = Geometry::new([a, beside, c], [0.015; MOTORS]).unwrap();
        let hang = lowest_point(&g, [0.8, 0.1, 2.0]).unwrap();
        assert_eq!(hang.slack, [true, false, true], "the lower motor's short cable holds the ball");
        assert!((hang.ball - (beside - Vector3::z() * 0.1)).norm() < 1e-12);
    }

    #[test]
    fn cables_that_cannot_meet_are_named() {
        let g = Geometry::paper();
        let err = lowest_point(&g, [0.3, 0.3, 1.0]).unwrap_err();
        assert!(matches!(err, RigError::TooShort { first: 'A', second: 'B', .. }), "{err}");
        // The edges are 0.61, 0.88 and 0.93 m: each two meet, but C does not reach where A and B
        // do.
        let lengths_m = [0.33, 0.29, 0.61];
        assert_eq!(lowest_point(&g, lengths_m), Err(RigError::TooShortTogether { lengths_m }));
        assert!(matches!(
            lowest_point(&g, [0.5, -0.1, 1.0]),
            Err(RigError::NoCable { motor: 'B', .. })
        ));
        assert!(matches!(lowest_point(&g, [0.5, f64::NAN, 1.0]), Err(RigError::OutOfRange { .. })));
    }

    #[test]
    fn in_a_plane_the_third_cable_has_no_effect() {
        let g = planar_rig();
        let ball = Point3::new(0.0, 0.3, 0.6);
        let [a, b, _] = g.cable_lengths_m(&ball);
        for length in [0.0, -1.0, 0.1, f64::NAN] {
            let hang = lowest_point(&g, [a, b, length]).unwrap();
            assert!((hang.ball - ball).norm() < 1e-12 && hang.ball.x == 0.0, "{}", hang.ball);
            assert_eq!(hang.slack, [false; MOTORS]);
            let far = lowest_point(&g, [a + 3.0, b, length]).unwrap();
            assert_eq!(
                (far.ball, far.slack[..2].to_vec()),
                (Point3::new(0.0, 0.0, 1.1 - b), vec![true, false])
            );
            let short = lowest_point(&g, [0.4, 0.5, length]);
            assert!(matches!(short, Err(RigError::TooShort { first: 'A', second: 'B', .. })));
        }
    }

    /// Checks that the point is within reach, and that pulling cables alone balance gravity. These
    /// Karush-Kuhn-Tucker conditions are necessary and sufficient for a convex problem.
    fn check_lowest(g: &Geometry, lengths: PerMotor<f64>) -> Result<(), TestCaseError> {
        match lowest_point(g, lengths) {
            Ok(hang) => {
                for (i, motor) in g.motors().iter().enumerate().take(g.count()) {
                    let free = lengths[i] - (hang.ball - motor).norm();
                    prop_assert!(free > -1e-9, "cable {i} is stretched by {free} m");
                    prop_assert!(
                        hang.slack[i] || free < 1e-9,
                        "cable {i} is not slack, but {free} m are free"
                    );
                }
                let (a, residual) = multipliers(g, &hang);
                prop_assert!(a.iter().all(|a| *a > -1e-6), "a cable pushes: {a:?}");
                prop_assert!(residual < 1e-4, "the ball is not at rest: {residual}");
            }
            Err(RigError::TooShort { sum_m, apart_m, .. }) => prop_assert!(sum_m < apart_m),
            Err(RigError::TooShortTogether { .. }) => {
                prop_assert!(g.count() == MOTORS && !some_point_within(g, lengths));
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(proptest_config())]

        #[test]
        fn no_point_within_reach_is_lower(
            lengths in prop::array::uniform3(0.05..2.0f64),
            heights in prop::array::uniform3(-0.2..0.2f64),
        ) {
            check_lowest(&rig(heights), lengths)?;
            check_lowest(&planar_rig(), lengths)?;
        }

        #[test]
        fn forward_of_inverse_is_the_same_point(
            l in prop::array::uniform3(0.02..1.0f64),
            h in 0.02..2.0f64,
            heights in prop::array::uniform3(-0.2..0.2f64),
        ) {
            let (g, sum) = (rig(heights), l.iter().sum::<f64>());
            let weighted = g.motors().iter().zip(l).map(|(m, l)| m.coords * (l / sum));
            let ball = Point3::from(weighted.sum::<Vector3<f64>>()) - Vector3::z() * h;
            let hang = lowest_point(&g, g.cable_lengths_m(&ball)).unwrap();
            prop_assert!((hang.ball - ball).norm() < 1e-8, "{} is not {ball}", hang.ball);
            prop_assert_eq!(hang.slack, [false; MOTORS]);
        }

        /// Checks that 1 µm of cable moves the ball only a little, also where a cable goes slack
        /// or two cables are in line.
        #[test]
        fn the_ball_does_not_jump(
            lengths in prop::array::uniform3(0.5..2.0f64),
            motor in 0..3usize,
            heights in prop::array::uniform3(-0.2..0.2f64),
        ) {
            let g = rig(heights);
            let mut longer = lengths;
            longer[motor] += 1e-6;
            if let (Ok(before), Ok(after)) = (lowest_point(&g, lengths), lowest_point(&g, longer)) {
                // The worst case is a square root, at two cables in line: sqrt(2 · 1e-6 · 2 m).
                let moved = (after.ball - before.ball).norm();
                prop_assert!(moved < 4e-3, "{moved} m from {} to {}", before.ball, after.ball);
            }
        }
    }

    /// Searches a point within reach by relaxation of the most exceeded cable.
    fn some_point_within(g: &Geometry, lengths: PerMotor<f64>) -> bool {
        let mut p = g.motors()[0];
        for _ in 0..20_000 {
            let over = |i: usize| (p - g.motors()[i]).norm() - lengths[i];
            let Some(worst) = (0..MOTORS).max_by(|i, j| over(*i).total_cmp(&over(*j))) else {
                return false;
            };
            let excess = over(worst);
            if excess <= 0.0 {
                return true;
            }
            p -= (p - g.motors()[worst]).normalize() * excess;
        }
        false
    }

    /// Checks that the ball moves continuously where a cable goes slack.
    #[test]
    fn going_slack_is_continuous() {
        let g = Geometry::paper();
        let mut last = lowest_point(&g, [0.7, 0.75, 0.9]).unwrap();
        let mut changes = 0;
        for k in 1..=50_000 {
            let next = lowest_point(&g, [0.7, 0.75, 0.9 + f64::from(k) * 1e-5]).unwrap();
            assert!(
                (next.ball - last.ball).norm() < 5e-4,
                "jump at {k}: {} to {}",
                last.ball,
                next.ball
            );
            changes += usize::from(next.slack != last.slack);
            last = next;
        }
        assert_eq!(changes, 1, "cable C goes slack once");
        assert!(last.slack[2]);
    }
}
