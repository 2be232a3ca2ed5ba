use plumb_core::BuildLimits;
use plumb_core::law::{Interval as FixedPoint, LawTicks, V_FRACTION_BITS};
use plumb_core::params::Params;
use plumb_protocol::config::{self, Config};
use plumb_protocol::units::{Bound, Gain};
use plumb_protocol::{MOTORS, PerAxis, PerMotor, Wiring};
use proptest::prelude::*;

use super::*;
use crate::IntervalMatrix;

/// Families in the board's units: any signs, any bounds α_ik <= β_ik up to 8.
fn board_families() -> impl Strategy<Value = config::Interval> {
    let signs = proptest::array::uniform9(-1i8..=1);
    let bounds = proptest::array::uniform9((1u32..1 << 18, 0u32..1 << 18));
    (signs, bounds).prop_map(|(signs, bounds)| {
        let at =
            |f: &dyn Fn(usize) -> u32| [0, 3, 6].map(|r| [r, r + 1, r + 2].map(|n| Bound(f(n))));
        let mut signs = [0, 3, 6].map(|r| [r, r + 1, r + 2].map(|n| signs[n]));
        // Every column has an entry that is not zero.
        let idle: Vec<_> = (0..MOTORS).filter(|&k| signs.iter().all(|row| row[k] == 0)).collect();
        idle.into_iter().for_each(|k| signs[k][k] = -1);
        let (alpha, beta) = (at(&|n| bounds[n].0), at(&|n| bounds[n].0 + bounds[n].1));
        config::Interval {
            signs: signs.map(Into::into),
            alpha: alpha.map(Into::into),
            beta: beta.map(Into::into),
            gain: Gain(1 << 16),
        }
    })
}

/// Returns the board's law for the family.
fn fixed_point(family: config::Interval) -> FixedPoint {
    let config = Config { law: config::Law::Interval(family), ..Config::example() };
    let build = BuildLimits {
        max_pulse_rate: 1_000_000,
        storage: true,
        chip: None,
        law_ticks: LawTicks::RP2040,
    };
    Params::check(&config, &Wiring::example().drivers, &build).unwrap().interval().unwrap()
}

/// Converts a family in the board's units.
fn interval_matrix(board: &config::Interval) -> IntervalMatrix {
    let entry = |i: usize, k: usize| {
        let (a, b) = (board.alpha[i][k].to_si(), board.beta[i][k].to_si());
        match board.signs[i][k] {
            0 => Interval::point(0.0),
            1 => Interval::new(a, b),
            _ => Interval::new(-b, -a),
        }
    };
    IntervalMatrix(std::array::from_fn(|i| std::array::from_fn(|k| entry(i, k))))
}

/// Interval matrices with entries of any sign, so that v is often 0.
fn any_family() -> impl Strategy<Value = IntervalMatrix> {
    proptest::array::uniform9((-1.0f64..1.0, 0.0f64..1.0)).prop_map(|entries| {
        IntervalMatrix([0, 3, 6].map(|r| {
            [r, r + 1, r + 2].map(|n| Interval::new(entries[n].0, entries[n].0 + entries[n].1))
        }))
    })
}

/// Matrices with entries from -1 to 1.
fn matrices() -> impl Strategy<Value = PerAxis<PerMotor<f64>>> {
    proptest::array::uniform3(proptest::array::uniform3(-1.0f64..1.0))
}

fn distance(a: PerMotor<f64>, b: PerMotor<f64>) -> f64 {
    let d = std::array::from_fn(|k| a[k] - b[k]);
    inner(d, d).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// The explicit formula solves the minimum-norm problem over the family's corners. The
    /// tolerance is the error bound of the solution's duality gap, |v - v(e)|² <= gap. The
    /// solver's tolerance for the gap is 1e-12 where |M'e| is about 1.
    #[test]
    fn the_explicit_formula_solves_problem_8(
        family in any_family(), e in proptest::array::uniform3(-1.0f64..1.0),
    ) {
        let found = Polytope::new(family.vertices()).unwrap().minimum_norm(e).unwrap();
        prop_assert!(found.error < 1e-5, "{found:?}");
        let explicit = family.v(e);
        prop_assert!(
            distance(found.v, explicit) <= found.error + 1e-12, "{found:?}, {explicit:?}"
        );
    }

    /// The board rounds each component of v towards zero to 1/256 µm.
    #[test]
    fn the_boards_law_solves_problem_8(
        board in board_families(), e in proptest::array::uniform3(-20_000i32..20_000),
    ) {
        let polytope = Polytope::new(interval_matrix(&board).vertices()).unwrap();
        let found = polytope.minimum_norm(e.map(f64::from)).unwrap();
        // In µm. |M'e| is at most 480 000, and v saturates at 524 288 on the board.
        prop_assert!(found.error < 5.0, "{found:?}");
        let unit = 1.0 / f64::from(1u32 << V_FRACTION_BITS);
        let fixed = fixed_point(board).v(e).map(|v| f64::from(v) * unit);
        prop_assert!(
            distance(found.v, fixed) <= found.error + 2.0 * unit, "{fixed:?} for {found:?}"
        );
    }

    /// e'Mv >= |v|² for every M of a polytope.
    #[test]
    fn e_decreases_for_every_member(
        vertices in proptest::collection::vec(matrices(), 1..12),
        e in proptest::array::uniform3(-1.0f64..1.0),
    ) {
        let polytope = Polytope::new(vertices.clone()).unwrap();
        let v = polytope.minimum_norm(e).unwrap().v;
        for m in &vertices {
            prop_assert!(inner(transposed_times(m, e), v) >= inner(v, v) - 1e-10);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// For interval matrices, branch and bound agrees with the vertex determinants.
    #[test]
    fn both_proofs_of_nonsingularity_agree(
        centre in proptest::array::uniform9(-1.0f64..1.0), width in 0.0f64..0.3,
    ) {
        let family = IntervalMatrix([0, 3, 6].map(|r| [r, r + 1, r + 2].map(|n| {
            // Four entries are not points: 16 corners.
            let width = if n % 2 == 0 && n != 4 { width } else { 0.0 };
            Interval::new(centre[n], centre[n] + width)
        })));
        let found = Polytope::new(family.vertices()).unwrap().robustness(3000);
        match found.nonsingularity {
            Nonsingularity::Proved => prop_assert!(family.is_nonsingular()),
            Nonsingularity::Refuted => prop_assert!(!family.is_nonsingular()),
            Nonsingularity::Undecided => prop_assert!(found.min_v.lo == 0.0),
        }
        if found.nonsingularity == Nonsingularity::Proved {
            let explicit = family.min_v();
            let overlap = found.min_v.lo <= explicit.hi && explicit.lo <= found.min_v.hi;
            prop_assert!(overlap, "{found:?} {explicit:?}");
        }
    }
}

fn diagonal(x: f64, y: f64, z: f64) -> PerAxis<PerMotor<f64>> {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

#[test]
fn a_single_matrix_has_its_smallest_singular_value() {
    let found = Polytope::new(vec![diagonal(3.0, 0.5, -2.0)]).unwrap().robustness(10_000);
    assert_eq!(found.nonsingularity, Nonsingularity::Proved);
    assert!(
        found.min_v.lo <= 0.5 && 0.5 <= found.min_v.hi && found.min_v.width() < 0.03,
        "{found:?}"
    );
    assert!(found.direction[1].abs() > 0.95, "{found:?}");
}

/// All vertices have determinant 1, but half the sum of the first two is singular. The vertices
/// alone do not show this.
#[test]
fn a_singular_member_inside_is_found() {
    let vertices = vec![
        diagonal(1.0, 1.0, 1.0),
        diagonal(-1.0, -1.0, 1.0),
        [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    ];
    let two = Polytope::new(vertices[..2].to_vec()).unwrap().robustness(10_000);
    assert_ne!(two.nonsingularity, Nonsingularity::Proved, "{two:?}");
    let mut inside = vertices.clone();
    inside.push([[0.5, 1.0, 0.0], [1.0, 2.5, 0.0], [0.0, 0.0, 1.0]]);
    let found = Polytope::new(inside).unwrap().robustness(10_000);
    assert_eq!(found.nonsingularity, Nonsingularity::Refuted, "{found:?}");
}

#[test]
fn errors_name_the_invalid_entry() {
    assert!(matches!(Polytope::new(vec![]), Err(PolytopeError::Empty)));
    let nan = Polytope::new(vec![diagonal(1.0, 1.0, 1.0), diagonal(1.0, f64::NAN, 1.0)]);
    assert!(matches!(nan, Err(PolytopeError::Entry { vertex: 2, .. })), "{nan:?}");
    let zero = Polytope::new(vec![diagonal(0.0, 0.0, 0.0)]).unwrap();
    assert_eq!(zero.minimum_norm([1.0, 2.0, 3.0]).unwrap().v, [0.0; MOTORS]);
    assert_eq!(zero.robustness(100).nonsingularity, Nonsingularity::Undecided);
}
